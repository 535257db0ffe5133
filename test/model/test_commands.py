"""Commands: the paper's formula, band limits, seeds, bounded displacement, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from actuator_glue.api.simulation import simulate
from actuator_glue.errors import InputError
from actuator_glue.model import commands, reference_problem
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.records import Record


def test_default_sweep_is_the_papers():
    t = np.arange(12_001) / 200.0
    np.testing.assert_allclose(
        commands.sweep(200.0), 2e-3 * np.sin(np.pi * (10 / 60) * t**2), atol=1e-15
    )


def test_sine_and_sweep_ends():
    u = commands.sine(1000.0, 2.0, 5.0, 1e-3)
    assert len(u) == 2001
    np.testing.assert_allclose(u[50], 1e-3, rtol=1e-9)  # a quarter of 0.2 s
    f = signal.ShortTimeFFT(signal.windows.hann(2000), 500, 1000.0)
    power = f.spectrogram(commands.sweep(1000.0, 20.0, 10.0, 2.0))
    peaks = f.f[power.argmax(axis=0)]
    assert peaks[5] > 8.0 and peaks[-6] < 4.0


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    rate=st.sampled_from([200.0, 1000.0]),
    band=st.tuples(st.floats(0.1, 5.0), st.floats(6.0, 20.0)),
    amplitude=st.floats(1e-5, 0.1),
)
def test_noise_is_banded_scaled_and_at_rest_at_both_ends(seed, rate, band, amplitude):
    u = commands.noise(rate, 30.0, *band, amplitude, seed)
    assert np.abs(u).max() == pytest.approx(amplitude)
    assert abs(u[0]) + abs(u[-1]) < 1e-12
    f, power = signal.periodogram(u, rate, 'hann')
    outside = (f < band[0] - 0.5) | (f > band[1] + 0.5)
    assert power[outside].sum() < 1e-3 * power.sum()
    np.testing.assert_array_equal(u, commands.noise(rate, 30.0, *band, amplitude, seed))
    assert not np.array_equal(u, commands.noise(rate, 30.0, *band, amplitude, seed + 1))


@pytest.mark.parametrize('seed', range(5))
def test_earthquake_starts_and_ends_at_rest_without_drift(seed):
    u = commands.earthquake(1000.0, 40.0, 20e-3, seed)
    assert np.abs(u).max() == pytest.approx(20e-3)
    assert np.abs(u[:100]).max() < 1e-5
    assert np.abs(u[-2000:]).max() < 0.05 * 20e-3
    # The strong phase comes before the middle, and the filter passes little above 10 Hz.
    assert np.abs(u).argmax() < 20_000
    f, power = signal.welch(u, 1000.0, nperseg=8192)
    assert power[f > 10.0].sum() < 1e-3 * power.sum()


def test_recorded_keeps_the_meaning_of_the_hold():
    u = np.array([0.0, 1e-3, -1e-3, 2e-3])
    zoh = Record(u, u, 0.1)
    linear = Record(u, u, 0.1, hold='linear')
    np.testing.assert_array_equal(commands.recorded(zoh), u)
    np.testing.assert_array_equal(
        commands.recorded(zoh, 20.0), np.array([0.0, 0.0, 1, 1, -1, -1, 2]) * 1e-3
    )
    np.testing.assert_allclose(
        commands.recorded(linear, 20.0), np.array([0, 0.5, 1, 0, -1, 0.5, 2]) * 1e-3, atol=1e-15
    )
    assert np.abs(commands.recorded(zoh, amplitude=5e-3)).max() == pytest.approx(5e-3)


def test_a_recorded_command_of_counts_is_no_displacement():
    """A count stands in a record as a micrometre, and is none."""
    u = np.array([0.0, 1e-3, -1e-3, 2e-3])
    counts = Record(u, u, 0.1, source='adc.csv', motion='counts')
    message = r'adc\.csv: the command is in counts, .* metres; give mm per counts as `scale`'
    for use in (commands.recorded, simulate):
        with pytest.raises(InputError, match=message):
            use(counts)


@pytest.mark.parametrize(
    ('make', 'message'),
    [
        (lambda: commands.sweep(-1.0), 'rate'),
        (lambda: commands.sweep(np.nan), 'rate'),
        (lambda: commands.sweep(200.0, 0.0), 'duration'),
        (lambda: commands.sweep(200.0, 1e12), 'samples'),
        (lambda: commands.sweep(200.0, 60.0, 0.0, 150.0), 'frequency 150'),
        (lambda: commands.sine(200.0, amplitude=1e6), 'amplitude'),
        (lambda: commands.noise(200.0, 10.0, 5.0, 5.001), 'no frequency'),
        (lambda: commands.earthquake(200.0, ground_damping=0.0), 'ground_damping'),
    ],
)
def test_refusals_say_what_to_change(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_problem_r_is_the_specified_one():
    first, second = reference_problem.records()
    assert (len(first), len(second)) == (12_001, 12_001)
    assert (first.stiffness, second.stiffness) == (0.0, 250e3)
    noise = np.random.default_rng(1).standard_normal(24_002)
    a, b, c, d, _ = signal.cont2discrete(signal.tf2ss([2208.0], [1, 133.0, 2101.0]), 1 / 200)
    _, y, _ = signal.dlsim((a, b, c, d, 1 / 200), second.command)
    np.testing.assert_allclose(second.measured, y[:, 0] + 2e-5 * noise[12_001:], atol=1e-12)
    assert reference_problem.records(2)[0].measured[5] != first.measured[5]


def test_problem_r_maximum_of_the_likelihood():
    """L = 1764.79 at the best theta (mm, G = 2^8); the mean of the posterior is close to it."""
    from actuator_glue.model.exact import ExactErrors

    errors = ExactErrors(reference_problem.records())
    n = errors.sizes.sum()
    s, q = errors([133.65, 1.1005e9, 2.4927e5, 0.0])[:].sum(axis=0)
    best = -256 * np.log(1e6 * (q / n - (s / n) ** 2))
    assert best == pytest.approx(1764.79, abs=0.3)
    s, q = errors(TABLE_2).sum(axis=0)
    assert -256 * np.log(1e6 * (q / n - (s / n) ** 2)) < best
