"""Tracking indicators held to pure delays and ellipses."""

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.hybrid.indicators import TargetMotion, energy_error, tracking_indicator

PERIOD = 1e-3
TIME = PERIOD * np.arange(4000)


@pytest.mark.parametrize('delay', [-0.02, 0.005, 0.03, 0.15])
def test_a_delayed_sine(delay: float) -> None:
    """Delay and amplitude, also beyond a quarter of the period, where an arctangent folds."""
    target, measured = (np.sin(2 * np.pi * 2.0 * t) for t in (TIME, TIME - delay))
    asked = TargetMotion(target, PERIOD)
    found = asked.frequency_evaluation(0.9 * measured)
    assert found == pytest.approx((0.9, delay, 2.0), rel=1e-9)
    assert asked.criteria(measured).j1 == pytest.approx(delay, abs=2 * PERIOD)
    j2 = 2.0 * abs(np.sin(2 * np.pi * delay))
    assert asked.criteria(measured)[1:] == pytest.approx((j2, j2), rel=1e-3)


def test_the_index_is_the_ratio_of_spectra(rng_seed: int) -> None:
    """Guo et al. (2014), of noise of an odd and of an even length."""
    rng = np.random.default_rng(rng_seed)
    for size in (501, 500):
        target, measured = rng.standard_normal((2, size))
        x, y = np.fft.rfft(target)[1:], np.fft.rfft(measured)[1:]
        index = (y * x.conj()).sum() / (np.abs(x) ** 2).sum()
        found = TargetMotion(target, PERIOD).frequency_evaluation(measured)
        assert found.amplitude == pytest.approx(abs(index), rel=1e-9)
        angle = -2.0 * np.pi * found.frequency * found.delay
        assert np.exp(1j * angle) == pytest.approx(index / abs(index), rel=1e-9)
        assert TargetMotion(target, PERIOD).criteria(target[::-1]).j1 == PERIOD * (
            int(np.argmax(np.correlate(target[::-1], target, 'full'))) - (size - 1)
        )


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
            TargetMotion(wrong, PERIOD).criteria(TIME)


@pytest.mark.parametrize('lag', [0.05, -0.08])
def test_energy_error_of_an_elastic_specimen(lag: float) -> None:
    """Each cycle of a late sine feeds in pi k A^2 sin(lag), of work and strain energy so far."""
    k, amplitude, cycles = 2e5, 0.003, 4
    t = np.linspace(0.0, 2.0 * np.pi * cycles, 40_001)
    target, measured = amplitude * np.sin(t), amplitude * np.sin(t - lag)
    found = energy_error(target, measured, k * measured, k)
    lost = -cycles * np.pi * k * amplitude**2 * np.sin(lag)
    work = np.concatenate(
        [[0.0], np.cumsum(0.5 * k * (measured[1:] + measured[:-1]) * np.diff(target))]
    )
    whole = np.abs(work).max() + 0.5 * k * amplitude**2
    assert found[-1] == pytest.approx(lost / whole, rel=1e-3)
    assert not energy_error(target, target, k * target, k).any()


def test_last_values_alone_are_those_of_the_rows(rng_seed: int) -> None:
    """Of noise, of a target that ends elsewhere, of a specimen that is never reached."""
    rng = np.random.default_rng(rng_seed)
    for scale in (1.0, 0.01, 0.0):
        target, measured = 1e-3 * np.cumsum(rng.standard_normal((2, 500)), axis=1)
        measured, k = scale * measured + rng.uniform(0.0, 1e-3), rng.uniform(1e4, 1e6)
        asked = TargetMotion(target, PERIOD)
        row = energy_error(target, measured, k * measured, k)
        assert asked.energy_error(measured) == pytest.approx(row[-1], rel=1e-9)
        assert asked.tracking_indicator(measured) == pytest.approx(
            tracking_indicator(target, measured)[-1], rel=1e-9, abs=1e-18
        )


def test_energy_error_refuses() -> None:
    """A force of another length, no stiffness."""
    x = np.sin(np.arange(100.0))
    for force, k in ((x[:50], 1.0), (x, 0.0), (x * np.nan, 1.0)):
        with pytest.raises(InputError):
            energy_error(x, x, force, k)
