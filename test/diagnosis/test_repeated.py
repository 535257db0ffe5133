"""After how many samples a command repeats itself."""

import numpy as np
import pytest

from actuator_glue.diagnosis.measured import hum

RATE = 200.0
T = np.arange(int(12 * RATE)) / RATE
SWEEP = np.sin(np.pi * (8.0 / 12.0) * T**2)


@pytest.mark.parametrize('times', [2, 3, 7.5])
@pytest.mark.parametrize('sizes', [1.0, 0.5])
def test_sweeps_are_repeated(times: float, sizes: float, rng_seed: int) -> None:
    """Alike or growing, with a reading's noise on them, the last one cut off or not."""
    size = np.linspace(sizes, 1.0, 8)
    command = np.concatenate([a * SWEEP for a in size])[: int(times * len(T))]
    command += 0.02 * np.random.default_rng(rng_seed).standard_normal(len(command))
    assert hum.period(command + 3.0) == len(T)


def test_a_sinusoid_repeats_itself_each_period() -> None:
    """Of 1.6 Hz, after 125 samples."""
    assert hum.period(np.sin(2.0 * np.pi * 1.6 * T)) == 125


@pytest.mark.parametrize('name', ['sweep', 'noise', 'ramp', 'nothing'])
def test_what_is_not_repeated(name: str, rng_seed: int) -> None:
    """One sweep, noise in a band of 2 Hz, one ramp and rest."""
    rng = np.random.default_rng(rng_seed)
    smooth = np.convolve(rng.standard_normal(len(T)), np.hanning(100), 'same')
    command = {'sweep': SWEEP, 'noise': smooth, 'ramp': T, 'nothing': np.zeros(len(T))}[name]
    assert hum.period(command) == len(T)
