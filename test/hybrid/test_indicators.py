"""Tracking indicators held to pure delays and ellipses."""

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.hybrid.indicators import criteria, frequency_evaluation, tracking_indicator

PERIOD = 1e-3
TIME = PERIOD * np.arange(4000)


@pytest.mark.parametrize('delay', [-0.02, 0.005, 0.03, 0.15])
def test_a_delayed_sine(delay: float) -> None:
    """Delay and amplitude, also beyond a quarter of the period, where an arctangent folds."""
    target, measured = (np.sin(2 * np.pi * 2.0 * t) for t in (TIME, TIME - delay))
    found = frequency_evaluation(target, 0.9 * measured, PERIOD)
    assert found == pytest.approx((0.9, delay, 2.0), rel=1e-9)
    assert criteria(target, measured, PERIOD).j1 == pytest.approx(delay, abs=2 * PERIOD)
    j2 = 2.0 * abs(np.sin(2 * np.pi * delay))
    assert criteria(target, measured, PERIOD)[1:] == pytest.approx((j2, j2), rel=1e-3)


def test_the_area_of_an_ellipse() -> None:
    """Pi a b sin(phase) a cycle, positive where the measured lags."""
    phase = 2 * np.pi * 2.0 * PERIOD * np.arange(4001)
    for lag in (0.3, -0.3):
        found = tracking_indicator(2.0 * np.sin(phase), 1.5 * np.sin(phase - lag))
        assert found[-1] == pytest.approx(8 * np.pi * 3.0 * np.sin(lag), rel=1e-4)


def test_rows_that_cannot_be_compared() -> None:
    """Lengths, NaN, rest."""
    for wrong in (np.zeros(4000), TIME[:10], np.full(4000, np.nan)):
        with pytest.raises(InputError):
            criteria(wrong, TIME, PERIOD)
