"""What held-out error the parameters' uncertainty can account for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import chi2

from actuator_glue.diagnosis.posterior.simulation_spread import reached


@pytest.mark.parametrize('size', [0.1, 1.0, 3.0])
def test_the_least_error_within_the_region(size: float, rng_seed: int) -> None:
    """As a constrained minimisation over the parameters finds it."""
    rng = np.random.default_rng(rng_seed)
    slopes = rng.standard_normal((500, 3)) * [5.0, 1.0, 0.1]
    draws = rng.standard_normal((100, 3))
    error = slopes @ rng.standard_normal(3) * size + 0.5 * rng.standard_normal(500)
    root = np.linalg.cholesky(draws.T @ draws / 100)
    found = minimize(
        lambda b: float(np.sum((error - slopes @ root @ b) ** 2)),
        np.zeros(3),
        constraints=[{'type': 'ineq', 'fun': lambda b: chi2.ppf(0.95, 3) - b @ b}],
        tol=1e-12,
    )
    expected = float(np.sqrt(found.fun / 500))
    assert reached(error, draws @ slopes.T, 3) == pytest.approx(expected, rel=1e-4)


def test_an_error_in_another_direction_stays(rng_seed: int) -> None:
    """However far the parameters are open."""
    rng = np.random.default_rng(rng_seed)
    slopes, error = np.linalg.qr(rng.standard_normal((400, 5)))[0], np.zeros(400)
    error += slopes[:, 4]
    off = 100.0 * rng.standard_normal((60, 4)) @ slopes[:, :4].T
    assert reached(error, off, 4) == pytest.approx(float(np.sqrt(np.mean(error**2))))
    assert reached(slopes[:, 0], off, 4) < 1e-3 * float(np.sqrt(np.mean(slopes[:, 0] ** 2)))
