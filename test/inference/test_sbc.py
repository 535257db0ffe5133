"""Simulation-based calibration of the formal-likelihood sampler (Talts et al. 2018).

Parameters are drawn from the prior, data are simulated from them, and the rank of the true value
among independent posterior draws is uniform for every parameter if, and only if, likelihood,
priors and sampler agree.
"""

import numpy as np
import pytest
from scipy.stats import chisquare, kstest

from actuator_glue.inference.dream import sample
from actuator_glue.inference.likelihood import GaussianLikelihood
from actuator_glue.model import commands, linear
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import NAMES, bounds
from actuator_glue.model.reference_problem import STIFFNESS
from actuator_glue.records import Record

CASES = 300
DRAWS = 99  # ranks 0 ... 99
BINS = 20
NOISE = 0.05e-3  # m
RATE, DURATION = 100.0, 20.0
# Two tests for each of four parameters, Bonferroni: fails by chance in less than 1 of 1000 runs.
LEAST_P = 1e-3 / 8


def ranks(rng: np.random.Generator) -> np.ndarray:
    """Rank of a parameter set drawn from Table 3's prior among its posterior draws, (4,)."""
    lower, upper = bounds()
    truth = rng.uniform(lower, upper)
    command = commands.sweep(RATE, DURATION)
    records = []
    for stiffness in STIFFNESS:
        clean = linear.simulate(truth, command, stiffness=stiffness, period=1 / RATE)
        noisy = clean + NOISE * rng.standard_normal(len(command))
        records.append(Record(command, noisy, 1 / RATE, stiffness))
    likelihood = GaussianLikelihood(ExactErrors(records), NOISE)
    chains = sample(rng, likelihood, lower, upper, evaluations=30_000)
    assert chains.annealed
    # Thinned to independence: five effective draws for each one that is kept.
    while chains.ess.min() < 5 * DRAWS:
        more = 2 * chains.evaluations
        assert more < 2_000_000, f'the sampler does not mix at {truth}'
        chains = sample(rng, likelihood, lower, upper, evaluations=more)
    draws = chains.posterior()
    chosen = rng.choice(len(draws), DRAWS, replace=False)
    return np.sum(draws[chosen] < truth, axis=0)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_ranks_of_the_truth_are_uniform(rng_seed: int) -> None:
    rng = np.random.default_rng(rng_seed)
    found = np.array([ranks(rng) for _ in range(CASES)])
    for i, name in enumerate(NAMES):
        counts = np.bincount(found[:, i] * BINS // (DRAWS + 1), minlength=BINS)
        smooth = (found[:, i] + rng.random(CASES)) / (DRAWS + 1)
        p = chisquare(counts).pvalue, kstest(smooth, 'uniform').pvalue
        print(f'{name}: chi-square p {p[0]:.3f}, ECDF p {p[1]:.3f}, counts {counts.tolist()}')
        assert min(p) > LEAST_P, f'{name}: p = {p}, rank counts {counts.tolist()}'
