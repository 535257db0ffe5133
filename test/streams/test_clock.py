"""The sender's clock by the receiver's: offset, skew, steps, and stamps that only go forward."""

import numpy as np
import pytest

from actuator_glue.streams.clock import ClockMap

START = 1_700_000_000 * 10**9


def run(seconds, skew, offset=0.0, rate=500.0, seed=0, delay=2e-4, jump=None):
    """A sender's times, stamps given to them, and the map; delays are exponential."""
    rng = np.random.default_rng(seed)
    clock = ClockMap()
    sender = np.arange(0.0, seconds, 1.0 / rate)
    true = sender * (1.0 + skew) + offset
    if jump:
        true = true + np.where(sender > jump[0], jump[1], 0.0)
    arrival = true + rng.exponential(delay, len(sender)) + 1e-4
    stamps = []
    for s, a in zip(sender, arrival, strict=True):
        clock.update(s, START + round(a * 1e9))
        stamps.append(clock.stamp_ns(s))
    return sender, true, np.array(stamps), clock


@pytest.mark.parametrize('skew', [0.0, 50e-6, -200e-6])
def test_skew_is_found_through_jitter(skew, rng_seed):
    """Delays of 0.2 ms on average: over a minute the skew is known to 2 ppm."""
    _, true, stamps, clock = run(60.0, skew, offset=3.0, seed=rng_seed)
    assert abs(clock.skew - skew) < 2e-6
    error = (stamps - START) * 1e-9 - true
    # The shortest delay, 0.1 ms, cannot be told from an offset.
    assert np.abs(error[len(error) // 2 :] - 1e-4).max() < 5e-5
    assert abs(clock.offset - START * 1e-9 - 3.0 - skew * 60.0 - 1e-4) < 1e-4
    assert clock.spread < 5e-5 and clock.steps == 0


def test_stamps_go_forward_from_the_first_sample(rng_seed):
    """Also where the first messages were held up by 40 ms."""
    rng = np.random.default_rng(rng_seed)
    clock, last = ClockMap(), 0
    for i in range(3000):
        held = 0.04 if i < 20 else 0.0
        clock.update(1e-3 * i, START + round((1e-3 * i + held + rng.exponential(1e-3)) * 1e9))
        stamp = clock.stamp_ns(1e-3 * i)
        assert stamp > last
        last = stamp
    assert abs(last - START - 2.999e9) < 2e6


@pytest.mark.parametrize('step', [0.5, -0.5])
def test_a_clock_that_is_set_is_noticed(step):
    _, true, stamps, clock = run(60.0, 20e-6, jump=(30.0, step))
    assert clock.steps == 1
    error = (stamps - START) * 1e-9 - true
    assert np.abs(error[-5000:] - 1e-4).max() < 2e-4


def test_a_receiver_that_stalls_is_no_clock_that_is_set():
    """For 1.5 s everything arrives late; the map does not follow."""
    clock = ClockMap()
    for i in range(20_000):
        time = 2e-3 * i
        arrival = max(time, 21.5) if 20.0 <= time < 21.5 else time
        clock.update(time, START + round(arrival * 1e9))
        stamp = clock.stamp_ns(time)
        assert abs(stamp - START - time * 1e9) < 1e6
    assert clock.steps == 0
