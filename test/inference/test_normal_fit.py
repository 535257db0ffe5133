"""Moments of a nearly normal density from its values at draws."""

import numpy as np
import pytest

from actuator_glue.inference.normal_fit import refined

MEAN = np.array([2.0, -1.0, 500.0])
ROOT = np.array([[1e-3, 0.0, 0.0], [2e-3, 0.5, 0.0], [10.0, -40.0, 30.0]])


def drawn(rng, count):
    """Draws of a normal density whose directions differ by four decades, and its logarithm."""
    unit = rng.standard_normal((count, 3))
    return MEAN + unit @ ROOT.T, 7.0 - 0.5 * (unit**2).sum(axis=1)


def test_few_draws_give_a_normal_density_exactly():
    rng = np.random.default_rng(3)
    at, logs = drawn(rng, 120)
    found = refined(at, logs)
    sd = np.sqrt(np.diag(ROOT @ ROOT.T))
    assert (np.abs(at.mean(axis=0) - MEAN) / sd).max() > 0.03  # their own scatter
    assert np.abs(found.mean(axis=0) - MEAN) / sd == pytest.approx(0.0, abs=1e-6)
    assert np.cov(found.T, bias=True) == pytest.approx(ROOT @ ROOT.T, rel=1e-6)
    assert found.shape == (120, 3)


def test_a_skewed_density_is_told_better_than_its_draws_do(rng_seed):
    """Logarithms of gamma variates of shape 100; their mean is digamma(100), variance trigamma."""
    from scipy.special import polygamma

    rng = np.random.default_rng(rng_seed)
    errors = []
    # The ratio of variances is 0.217, its standard deviation 0.012; over 40 repeats 0.026, and one
    # run in a thousand was above the limit.
    for _ in range(200):
        at = np.log(rng.gamma(100.0, size=(400, 2)))
        found = refined(at, (100.0 * at - np.exp(at)).sum(axis=1))
        errors.append(
            [each.mean(axis=0) - polygamma(0, 100.0) for each in (at, found)]
            + [each.var(axis=0) / polygamma(1, 100.0) - 1.0 for each in (at, found)]
        )
    mean, mean_found, variance, variance_found = np.sqrt(np.mean(np.square(errors), axis=(0, 2)))
    assert mean_found < 0.3 * mean and variance_found < 0.3 * variance


@pytest.mark.parametrize('apart', [4.0, 30.0])
def test_two_hills_are_no_normal_density(apart):
    rng = np.random.default_rng(2)
    at = rng.standard_normal((500, 2)) + [apart, 0.0] * rng.integers(0, 2, (500, 1))
    logs = np.logaddexp(-0.5 * at[:, 0] ** 2, -0.5 * (at[:, 0] - apart) ** 2)
    assert refined(at, logs - 0.5 * at[:, 1] ** 2) is at


def test_too_few_draws_or_one_that_is_impossible_change_nothing():
    rng = np.random.default_rng(1)
    at, logs = drawn(rng, 49)
    assert refined(at, logs) is at
    at, logs = drawn(rng, 200)
    logs[3] = -np.inf
    assert refined(at, logs) is at
    same = np.repeat(MEAN[None], 200, axis=0)
    assert refined(same, np.zeros(200)) is same
