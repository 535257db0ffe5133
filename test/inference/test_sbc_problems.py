"""Simulation-based calibration (Talts et al. 2018) of the posteriors that `Problem` puts together.

As in test_sbc.py, with the coordinates and likelihoods of `calibrate` and of the online windows:
parameters from the prior, records from the parameters, ranks of the truth among posterior draws.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_glue.inference.choice import choose_model
from actuator_glue.inference.posterior import Likelihood, Problem, sample
from actuator_glue.model import commands
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

CASES = 100
DRAWS = 49  # ranks 0 ... 49
BINS = 10
RATE, DURATION, NOISE = 100.0, 10.0, 20e-6  # Hz, s, m
# Around Table 2, so that every truth can be simulated and sampled in little time; the bounds are
# part of each posterior.
BOX = {
    'beta_1': (80.0, 220.0),
    'alpha_1_beta_0': (6e8, 1.8e9),
    'alpha_2': (1.2e5, 5e5),
    'alpha_3': (0.0, 8.0),
    'delay': (0.0, 0.02),
    'backlash': (0.0, 2e-4),
}


@dataclass(frozen=True)
class Case:
    """One kind of posterior.

    Attributes:
        stiffnesses: of the records [N/m]; one alone has `ridge` coordinates.
        effects: beyond Eq. (2).
        likelihood: a formal one; its noise level is integrated out.
        warm: sampled again from its own first posterior, whose bends are taken off, as a window
            is from the one before.
        evaluations: of one run.
    """

    stiffnesses: tuple[float, ...]
    effects: tuple[str, ...] = ()
    likelihood: Likelihood = 'gaussian'
    warm: bool = False
    evaluations: int = 30_000


POSTERIORS = {
    'fast, two stiffnesses': Case((0.0, 250e3)),
    'fast, ridge': Case((250e3,)),
    'fast, ridge, warm': Case((250e3,), warm=True, evaluations=20_000),
    'fast, ridge, k = 0': Case((0.0,)),
    'ar1, two stiffnesses': Case((0.0, 250e3), likelihood='ar1', evaluations=20_000),
    'ridge, one effect': Case((250e3,), ('delay',), evaluations=20_000),
    'triangular, one effect': Case((250e3,), ('delay',), warm=True, evaluations=20_000),
    'triangular, two effects': Case(
        (250e3,), ('delay', 'backlash'), warm=True, evaluations=30_000
    ),
}


def ranks(seed: tuple[int, int], case: Case) -> Array:
    """Rank of parameters drawn from the prior among their posterior draws, (p,)."""
    rng = np.random.default_rng(seed)
    structure = Structure(case.effects)
    names = [p.name for p in structure.parameters]
    model = choose_model(case.effects, {name: BOX[name] for name in names})
    if case.likelihood == 'ar1':
        model = model.with_autocorrelation()
    lower, upper = model.bounds
    truth = rng.uniform(lower, upper)
    phi = truth[-1] if case.likelihood == 'ar1' else 0.0
    records = []
    for stiffness in case.stiffnesses:
        command = commands.noise(RATE, DURATION, 0.2, 8.0, seed=int(rng.integers(2**31)))
        still = Record(command, np.zeros(len(command)), 1.0 / RATE, stiffness)
        clean = structure.simulate(truth[np.newaxis, : len(names)], still, initial='rest')[0]
        # A stationary first sample, then AR(1).
        shock = rng.standard_normal(len(command)) * np.sqrt(1.0 - phi**2)
        shock[0] /= np.sqrt(1.0 - phi**2)
        records.append(replace(still, measured=clean + NOISE * lfilter([1.0], [1.0, -phi], shock)))
    problem = Problem(records, model, case.likelihood)
    chains = sample(problem.target(), seed, case.evaluations)
    if case.warm:
        shown = chains.posterior()[:: max(1, chains.posterior().shape[0] // 400)]
        target = replace(problem, shown=shown).target()
        assert target.transform is not None
        chains = sample(
            target,
            (*seed, 1),
            case.evaluations,
            archive=target.transform.forward(np.ascontiguousarray(shown)),
        )
    assert chains.annealed and chains.ess.min() > 2 * DRAWS, (truth, chains.ess)
    draws = chains.posterior()
    chosen = draws[rng.choice(len(draws), DRAWS, replace=False)]
    return np.asarray((chosen < truth).sum(axis=0))


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize('name', POSTERIORS)
def test_ranks_of_the_truth_are_uniform(
    name: str, rng_seed: int, least_p: Callable[..., float]
) -> None:
    """Two tests for each parameter, Bonferroni: one case fails by chance once in 1000 runs."""
    case = POSTERIORS[name]
    found = np.array([ranks((rng_seed, number), case) for number in range(CASES)])
    least = least_p(name, found, DRAWS, BINS, rng_seed)
    assert least > 1e-3 / (2 * found.shape[1])
