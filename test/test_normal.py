"""The normal distribution's functions against scipy's."""

from __future__ import annotations

import numpy as np
from scipy import special

from actuator_glue.normal import below, quantile

LOW = np.geomspace(1.4e-11, 0.5, 400)
SHARES = np.concatenate([LOW, np.linspace(0.05, 0.95, 400), 1.0 - LOW])


def test_quantile_inverts_the_distribution_function():
    ours = np.array([quantile(share) for share in SHARES])
    np.testing.assert_allclose(ours, special.ndtri(SHARES), rtol=1e-14, atol=1e-15)
    assert -6.7 < quantile(0.0) < -6.6 and 6.6 < quantile(1.0 - 2.0**-53) < 6.7


def test_below_is_the_distribution_function():
    points = np.linspace(-8.0, 8.0, 500)
    np.testing.assert_allclose([below(z) for z in points], special.ndtr(points), rtol=1e-13)
