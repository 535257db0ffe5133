"""A declared sample rate held against clocks."""

import numpy as np
import pytest

from actuator_glue.clock_check import RateWatch, disagreement, rate_by_clock


@pytest.mark.parametrize('true', [500.0, 985.0, 1015.0, 2000.0])
@pytest.mark.parametrize('jitter', [0.0, 2e-3])
def test_another_rate_is_measured(true: float, jitter: float) -> None:
    """Of times that lie up to a few milliseconds late the rate is known within 0.5 %."""
    index = np.arange(0, 8000, 20)
    late = np.random.default_rng(5).exponential(jitter or 1.0, len(index)) * (jitter > 0.0)
    found = rate_by_clock(index, index / true + late, 1000.0)
    assert found == pytest.approx(true, rel=5e-3)


@pytest.mark.parametrize('true', [995.0, 1000.0, 1008.0])
def test_drift_and_jitter_are_no_other_rate(true: float) -> None:
    """Less than one in a hundred is drift."""
    index = np.arange(0, 8000, 20)
    late = np.random.default_rng(6).exponential(2e-3, len(index))
    assert rate_by_clock(index, index / true + late, 1000.0) is None


def test_a_clock_that_is_set_is_no_other_rate() -> None:
    """A step tells nothing of the rate, wherever it is."""
    index = np.arange(0, 4000, 20)
    for at in (20, 100, 180):
        for step in (-0.09, 0.09):
            time = index / 1000.0
            time[at:] += step
            assert rate_by_clock(index, time, 1000.0) is None


def test_a_clock_that_stands_still_is_told() -> None:
    """No rate is made of it, and no division by zero."""
    found = rate_by_clock(np.arange(4000), np.zeros(4000), 1000.0)
    assert found == float('inf')
    told = disagreement(1000.0, {"the sender's time": float('inf')})
    assert told == "the sample rate is said to be 1000 Hz, but the sender's time stands still"


def test_too_little_is_not_judged() -> None:
    """Less than two seconds by any clock, or few points."""
    assert rate_by_clock(np.arange(900), np.arange(900) / 500.0, 1000.0) is None
    assert rate_by_clock(np.arange(7), np.arange(7) * 2.0, 1000.0) is None


def test_a_watch_tells_within_seconds() -> None:
    """A stream of 1 kHz that is said to be 500 Hz, block by block."""
    watch = RateWatch(500.0)
    for index in range(0, 1600, 10):
        watch.push(index, index / 1000.0)
    assert watch.found == pytest.approx(1000.0)


def test_a_watch_is_patient_and_forgets() -> None:
    """One late stretch is a stall; a rate that agrees again is told no more."""
    watch = RateWatch(1000.0, patience=2)

    def run(begin: int, seconds: float, rate: float) -> int:
        for index in range(begin, begin + int(seconds * 1000), 10):
            watch.push(index, begin / 1000.0 + (index - begin) / rate)
        return begin + int(seconds * 1000)

    at = run(0, 4.0, 950.0)
    assert watch.found is None
    watch.begin()
    at = run(at, 8.0, 950.0)
    assert watch.found == pytest.approx(950.0, rel=2e-3)
    watch.begin()
    run(at, 4.0, 1000.0)
    assert watch.found is None


def test_memory_of_a_watch_is_bounded() -> None:
    """A rate declared far too high never ends a stretch by its own count."""
    watch = RateWatch(1e5)
    for index in range(200_000):
        watch.push(index, index * 1e-5)
    assert len(watch._points) <= 4096
    assert watch.found is None
