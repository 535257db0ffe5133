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
