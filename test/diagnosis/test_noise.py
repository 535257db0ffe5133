"""Noise and structure of a residual, told apart without a model."""

import numpy as np
import pytest
from scipy import signal

from actuator_glue.diagnosis.verdict.alarm import p_value
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.noise import split, structured, whiten, whitener
from actuator_glue.records import Record

RATE = 256.0
N = 15360


def noise(rng: np.random.Generator, colour: float, corner: float) -> np.ndarray:
    """White plus first-order noise of unit variance."""
    pole = np.exp(-2 * np.pi * corner / RATE)
    slow = signal.lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.standard_normal(N + 2000))
    return np.sqrt(1 - colour) * rng.standard_normal(N) + np.sqrt(colour) * slow[2000:]


@pytest.mark.parametrize(('colour', 'corner'), [(0.0, 1.0), (0.5, 5.0), (0.6, 20.0)])
def test_stationary_noise_is_all_noise(colour: float, corner: float) -> None:
    """Mean of 12 records: its scatter is below 0.02, so 0.08 fails less than once in 10^4."""
    rng = np.random.default_rng([3, int(10 * corner)])
    parts = [(split(e, 1 / RATE), e) for e in (noise(rng, colour, corner) for _ in range(12))]
    share = np.mean([s.noise**2 / np.mean(e**2) for s, e in parts])
    assert abs(share - 1.0) < 0.08


def test_a_p_value_of_no_structure_is_one_and_of_a_burst_small(rng_seed: int) -> None:
    """No structure at all is what chance brings always, however rounded."""
    rng = np.random.default_rng(rng_seed)
    still = next(e for e in (rng.standard_normal(N) for _ in range(1000)) if structured(e, 1) == 0)
    burst = still + np.where(np.arange(N) < N // 4, rng.standard_normal(N), 0.0)
    data = Data.whole([Record(np.zeros(N), np.zeros(N), 1.0, stiffness=0.0)])
    assert p_value(data, [split(still, 1.0)], 1) == 1.0
    assert p_value(data, [split(burst, 1.0)], 1) == 0.01


def test_whitened_noise_is_white() -> None:
    """Unit variance and no correlation; 0.04 is five standard errors."""
    e = noise(np.random.default_rng(5), 0.6, 3.0)
    w = whiten(e, whitener(split(e, 1 / RATE)))
    assert abs(w.var() - 1.0) < 0.05
    assert abs(np.corrcoef(w[1:], w[:-1])[0, 1]) < 0.04
    assert abs(np.corrcoef(e[1:], e[:-1])[0, 1]) > 0.3


def test_what_noise_leaves_of_an_offset_is_what_is_said(rng_seed: int) -> None:
    """An offset and a drift beside slow noise, of 120 records, in standard deviations told.

    The rms is 1.06 and 1.11 on average, with windows of 2 s alone 1.5 and 1.6; beyond 1.4 by
    chance, a chi-square of 120 over 191, once in 20 000 runs.
    """
    rng = np.random.default_rng(rng_seed)
    rows, scores = np.stack([np.ones(N), np.linspace(-1.0, 1.0, N)]), []
    for _ in range(120):
        e = noise(rng, 0.6, 0.5)
        taps = whitener(split(e, 1 / RATE))
        white = whiten(rows, taps)
        scores.append(white @ whiten(e, taps) / np.linalg.norm(white, axis=1))
    assert np.sqrt(np.mean(np.square(scores), axis=0)) == pytest.approx(1.05, abs=0.35)


@pytest.mark.parametrize('count', [40, 700, 9000])
def test_whitening_is_a_convolution_with_its_ends_held(count: int) -> None:
    """Rows shorter than the filter, of one block, and of several; all rows of a table."""
    rng = np.random.default_rng(count)
    taps = whitener(split(noise(rng, 0.5, 3.0), 1 / RATE))
    rows, half = rng.standard_normal((3, count)), len(taps) // 2
    expected = [
        np.convolve(np.pad(row, half, mode='edge'), taps, mode='valid')[-count:] for row in rows
    ]
    assert whiten(rows, taps) == pytest.approx(np.array(expected), abs=1e-12)
    assert whiten(rows[0], taps) == pytest.approx(expected[0], abs=1e-12)


def test_the_density_of_white_noise_is_flat_to_its_ends() -> None:
    """At 0 and Nyquist, too: half of it there made intervals of what acts slowly too narrow.

    Means of 40 densities that scatter by 0.2: 0.2 off by chance once in 10^9.
    """
    rng = np.random.default_rng(11)
    parts = [split(rng.standard_normal(N), 1 / RATE) for _ in range(40)]
    density = np.mean([0.5 * RATE * s.psd for s in parts], axis=0)
    assert density[[0, 1, 2, -2, -1]] == pytest.approx(1.0, abs=0.2)


def test_the_ends_of_a_drift_are_white_too() -> None:
    """A random walk 20 steps off zero; with zeros beyond it the mean squares were above 50.

    Of ten the mean of 10 x 20 samples with few independent ones among them: 0.6 to 1.4 over 200
    other seeds.
    """
    rng, ends = np.random.default_rng(9), []
    for _ in range(10):
        walk = np.cumsum(rng.standard_normal(N))
        w = whiten(walk - walk.mean(), whitener(split(walk, 1 / RATE)))
        ends.append(np.concatenate([w[:10], w[-10:]]) ** 2)
    assert np.mean(ends) == pytest.approx(1.0, abs=0.7)


@pytest.mark.parametrize('size', [0.7, 3.0])
def test_what_follows_a_sweep_is_structure(size: float) -> None:
    """A third harmonic along a sweep is found with its size."""
    t = np.arange(N) / RATE
    harmonic = np.sqrt(2) * size * np.sin(3 * np.pi / 6 * t**2)
    s = split(harmonic + noise(np.random.default_rng(7), 0.3, 5.0), 1 / RATE)
    assert s.structure == pytest.approx(size, rel=0.25)
    assert s.noise == pytest.approx(1.0, abs=0.15)


def test_offset_and_trend_are_structure() -> None:
    """Noise has neither mean nor trend."""
    t = np.linspace(-1, 1, N)
    s = split(2.0 + t + noise(np.random.default_rng(8), 0.0, 1.0), 1 / RATE)
    assert s.structure == pytest.approx(np.sqrt(4 + 1 / 3), rel=0.05)
