"""The start of the posterior's chains around a fit."""

import numpy as np

from actuator_glue.residual.posterior import _scaled


def test_an_unknown_direction_takes_no_digits_from_the_known_ones() -> None:
    """At k = 0 alpha_3 has no curvature to speak of; beta_1 must keep its spread all the same."""
    known = np.array([[5e-5, 1e-7], [1e-7, 4e-10]])
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = known
    covariance[2, 2] = 6e15
    covariance[2, :2] = covariance[:2, 2] = (1e3, 1e1)
    spread, correlation = _scaled(covariance, np.full(4, 7.0))
    assert spread[3] == 7.0
    values, vectors = np.linalg.eigh(correlation)
    root = spread[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    np.testing.assert_allclose((root @ root.T)[:2, :2], known, rtol=1e-9)
