"""Posterior moments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from actuator_glue.errors import InputError
from actuator_glue.inference.moments import moments


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


def test_what_moves_with_a_parameter_that_the_data_do_not_tell_is_not_told_either() -> None:
    """A ridge: of the second parameter only its ratio to the first is known, to 5 %."""
    rng = np.random.default_rng(3)
    wide, known = rng.uniform(0.0, 1.0, 4000), rng.normal(0.5, 0.01, 4000)
    ratio = wide * np.exp(0.05 * rng.standard_normal(4000))
    draws = np.column_stack([wide, ratio, 0.1 + 0.1 * ratio, known])
    dominated = moments(draws, np.zeros(4), np.ones(4)).prior_dominated
    # The third is narrow beside its box, and moves with the first; the last with none.
    assert draws[:, 2].std() < 0.25 / np.sqrt(12.0)
    assert dominated.tolist() == [True, True, True, False]
    # Moving with the ratio of two of them is no ridge: that ratio is told.
    tilted = known + 0.2 * (np.log(ratio) - np.log(wide))
    draws = np.column_stack([wide, ratio, tilted])
    assert moments(draws, np.zeros(3), np.ones(3)).prior_dominated.tolist() == [True, True, False]
