"""Simulation-based calibration (Talts et al. 2018) of the posterior that a diagnosis tells.

As in test/inference/test_sbc_problems.py: parameters from the prior, records from the parameters,
ranks of the truth among posterior draws. The structure is given; noise and whitening filters are
estimated from the residual, as they are in a diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from actuator_glue.diagnosis.posterior import posterior
from actuator_glue.diagnosis.posterior.discrepancy import _PRIOR, _SCALES, beside
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.inference.least_squares import space as working
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import fit
from actuator_glue.model import commands
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

CASES = 200
DRAWS = 49  # ranks 0 ... 49
BINS = 10
RATE, DURATION, NOISE = 100.0, 10.0, 20e-6  # Hz, s, m
# Around Table 2; the bounds are part of each posterior, uniform in Eq. (2)'s logarithms.
LOWER, UPPER = np.log([80.0, 6e8, 1.2e5, 0.5]), np.log([220.0, 1.8e9, 5e5, 8.0])
SIZES = {'delay': (0.0, 0.02), 'backlash': (0.0, 2e-4)}
SMALL = {'bias': 1e-4, 'gain': 1.03, 'backlash': 5e-5}  # sizes of what is not added


@dataclass(frozen=True)
class Case:
    """One kind of posterior.

    Attributes:
        stiffnesses: of the records [N/m]; one alone has straight coordinates.
        effects: beyond Eq. (2).
        evaluations: as a diagnosis has them; 0 for the Laplace approximation.
        allowance: there is something beside the structure that is not added to it.
        noise: standard deviation [m].
        leakage: least alpha_3 [1/s]; records do not tell a hundredth from none.
    """

    stiffnesses: tuple[float, ...]
    effects: tuple[str, ...] = ()
    evaluations: int = Thresholds().evaluations
    allowance: bool = False
    noise: float = NOISE
    leakage: float = 0.5


BOTH = (0.0, 250e3)
POSTERIORS = {
    # Little noise: alpha_3 near zero is not normal in its logarithm otherwise.
    'Laplace, two stiffnesses': Case(BOTH, evaluations=0, noise=4e-6),
    'one effect, two stiffnesses': Case(BOTH, ('delay',)),
    'two effects, two stiffnesses': Case(BOTH, ('delay', 'backlash')),
    'one effect, straight': Case((250e3,), ('delay',)),
    'two effects, straight': Case((250e3,), ('delay', 'backlash')),
    'one effect, straight, k = 0': Case((0.0,), ('delay',)),
    'one effect, allowance': Case(BOTH, ('delay',), allowance=True),
    'one effect, straight, allowance': Case((250e3,), ('delay',), allowance=True, leakage=1e-3),
}


SLOW_BUT_ONE = [
    pytest.param(name, marks=[pytest.mark.slow] if case.evaluations else [])
    for name, case in POSTERIORS.items()
]


def boxed(effects: tuple[str, ...]) -> Structure:
    """A structure whose effects have the bounds of `SIZES`."""
    model = Structure(effects)
    rows = zip(model.parameters[4:], (SIZES[name] for name in effects), strict=True)
    extra = (replace(p, lower=low, upper=high) for p, (low, high) in rows)
    model.parameters = (*model.parameters[:4], *extra)
    return model


def ranks(seed: tuple[int, int], case: Case) -> Array:
    """Rank of parameters drawn from the prior among their posterior draws, (p,)."""
    rng = np.random.default_rng(seed)
    model = boxed(case.effects)
    space = working.Space(model, DURATION)
    truth = space.theta(rng.uniform(space.lower, space.upper))
    still = []
    for stiffness in case.stiffnesses:
        command = commands.noise(RATE, DURATION, 0.2, 8.0, seed=int(rng.integers(2**31)))
        still.append(Record(command, 0.0 * command, 1.0 / RATE, stiffness))
    silent = Data.whole(still)
    clean = silent.simulate(model, truth)[0]
    small = {}
    for name, size in SMALL.items() if case.allowance else ():
        row = silent.simulate(Structure((name,)), np.append(truth[:4], size))[0]
        small[name] = row - silent.simulate(Structure(()), truth[:4])[0]
    scale = rng.choice(_SCALES, p=np.exp(_PRIOR))
    there = sum((scale * rng.standard_normal() * row for row in small.values()), 0.0 * clean)
    noise = case.noise * rng.standard_normal(len(clean))
    measured = silent.split(clean + there + noise)
    data = Data.whole([replace(r, measured=y) for r, y in zip(still, measured, strict=True)])
    found = fit(data, model, truth)
    scorer = Scorer.of(data, splits_of(data, found.error))
    draws = posterior.sample(
        model,
        found,
        scorer,
        beside=beside(small, case.effects, scorer),
        rng=rng,
        evaluations=case.evaluations,
        progress=lambda share: None,
    )
    chosen = draws.points[rng.choice(len(draws.points), DRAWS, replace=False)]
    return np.asarray((chosen < truth).sum(axis=0))


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize('name', SLOW_BUT_ONE)
def test_ranks_of_the_truth_are_uniform(
    name: str, rng_seed: int, least_p: Callable[..., float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two tests for each parameter, Bonferroni: one case fails by chance once in 1000 runs."""
    monkeypatch.setattr(working, '_LOG_LOWER', [*LOWER[:3], np.log(POSTERIORS[name].leakage)])
    monkeypatch.setattr(working, '_LOG_UPPER', UPPER)
    # What it adds to the spread is a precaution, no part of the posterior.
    monkeypatch.setattr(posterior, '_loosened', lambda around, theta, move, rng: theta)
    case = POSTERIORS[name]
    found = np.array([ranks((rng_seed, number), case) for number in range(CASES)])
    least = least_p(name, found, DRAWS, BINS, rng_seed)
    assert least > 1e-3 / (2 * found.shape[1])
