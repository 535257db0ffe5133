"""Behavioural weights, weighted quantiles, moments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from actuator_glue.errors import InputError
from actuator_glue.inference.glue import behavioural, effective_size, weighted_quantiles
from actuator_glue.inference.moments import moments


def test_behavioural_sets_are_weighted_by_their_likelihood() -> None:
    log_likelihood = np.array([-1000.0, -1001.0, -1005.0, np.nan, -np.inf, -1002.0])
    weights = behavioural(log_likelihood, margin=2.0)
    expected = np.array([1.0, np.exp(-1.0), 0.0, 0.0, 0.0, np.exp(-2.0)])
    assert np.allclose(weights, expected / expected.sum())
    assert np.count_nonzero(behavioural(log_likelihood, share=0.5)) == 3
    assert np.count_nonzero(behavioural(log_likelihood, share=1.0)) == 4
    assert np.count_nonzero(behavioural(log_likelihood, share=1e-9)) == 1


def test_prior_draws_with_weights_give_the_posterior(rng_seed: int) -> None:
    """False failure below 1e-6: five standard errors of the importance estimate."""
    rng = np.random.default_rng(rng_seed)
    x = rng.uniform(-5.0, 5.0, (400_000, 1))
    weights = behavioural(-0.5 * ((x[:, 0] - 1.0) / 0.5) ** 2, margin=50.0)
    size = effective_size(weights)
    found = moments(x, [-5.0], [5.0], weights=weights)
    assert abs(found.mean[0] - 1.0) < 5.0 * 0.5 / np.sqrt(size)
    assert abs(found.stddev[0] - 0.5) < 5.0 * 0.5 / np.sqrt(size)
    limits = weighted_quantiles(x[:, 0], [0.025, 0.5, 0.975], weights)
    assert np.allclose(limits, stats.norm.ppf([0.025, 0.5, 0.975], 1.0, 0.5), atol=0.05)
    both = weighted_quantiles(np.column_stack([x, -x]), [0.5], weights)
    assert both.shape == (1, 2) and np.isclose(both[0, 0], -both[0, 1])


@pytest.mark.parametrize(
    'arguments',
    [{}, {'margin': 1.0, 'share': 0.5}, {'margin': -1.0}, {'share': 0.0}, {'share': 1.5}],
)
def test_thresholds_that_cannot_be_are_said(arguments: dict[str, float]) -> None:
    with pytest.raises(InputError):
        behavioural(np.array([0.0, 1.0]), **arguments)
    with pytest.raises(InputError, match='finite'):
        behavioural(np.array([np.nan, -np.inf]), share=0.5)


def test_moments_are_those_of_scipy(rng_seed: int) -> None:
    rng = np.random.default_rng(rng_seed)
    draws = rng.gamma([1.0, 4.0, 9.0], [1e9, 1.0, 1e-3], (5000, 3))
    log_density = -draws[:, 1]
    found = moments(draws, np.zeros(3), [2e9, 200.0, 1.0], log_density=log_density)
    assert np.allclose(found.mean, draws.mean(axis=0))
    assert np.allclose(found.stddev, draws.std(axis=0))
    assert np.allclose(found.skewness, stats.skew(draws, axis=0))
    assert np.allclose(found.cov, stats.variation(draws, axis=0))
    assert found.best is not None and found.best[1] == draws[:, 1].min()
    # Standard deviations over their priors': 1.7, 0.035 and 0.010.
    assert found.prior_dominated.tolist() == [True, False, False]


def test_moments_of_constant_and_of_misshapen_draws() -> None:
    found = moments(np.ones((3, 2)), [0.0, 0.0], [2.0, 2.0])
    assert found.stddev.tolist() == [0.0, 0.0] and found.skewness.tolist() == [0.0, 0.0]
    with pytest.raises(InputError, match='shape'):
        moments(np.ones(3), [0.0], [1.0])
    with pytest.raises(InputError, match='log_density'):
        moments(np.ones((3, 1)), [0.0], [1.0], log_density=np.ones(2))
