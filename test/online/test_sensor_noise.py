"""Noise of a window's sensor: white, filtered, and beside what the model lacks."""

from dataclasses import replace

import numpy as np
import pytest
from live import results
from online_streams import RATE as SLOW
from online_streams import THETA, record, stream
from scipy import signal

from actuator_glue.model import linear
from actuator_glue.model.commands import noise as random_command
from actuator_glue.online.sensor_noise import sensor_noise, white_noise

RATE, SAMPLES, SD = 1000.0, 5000, 10e-6
TIME = np.arange(SAMPLES) / RATE
SWEEP = 2e-3 * signal.chirp(TIME, 1.0, TIME[-1], 10.0)


@pytest.mark.parametrize('sd', [1e-6, 2e-5])
def test_white_noise_is_seen_through_the_motion(sd):
    whole = record(20.0, rate=RATE, sd=sd)
    assert white_noise(whole.measured) == pytest.approx(sd, rel=0.05)
    assert white_noise(np.zeros(3)) == 0.0


def test_white_noise_is_left_as_it_is(rng_seed):
    """To the last bit: the spectrum says the same within some per cent."""
    noise = SD * np.random.default_rng(rng_seed).standard_normal(SAMPLES)
    white = white_noise(noise)
    assert sensor_noise(noise, SWEEP, white) == white


@pytest.mark.parametrize('cut', [40.0, 100.0])
def test_filtered_noise_is_seen(cut, rng_seed):
    """A transducer's filter takes all of it out of fourth differences: 2 and 7 % are left.

    Over seeds the estimate scatters by 6 %, its mean is 7 % low (at 40 Hz): 30 % is 3.6 standard
    deviations away (2e-4).
    """
    rng = np.random.default_rng(rng_seed)
    passed = signal.butter(2, cut, fs=RATE, output='sos')
    noise = signal.sosfilt(passed, rng.standard_normal(2 * SAMPLES))[SAMPLES:]
    noise *= SD / noise.std()
    white = white_noise(noise)
    assert white < 0.1 * SD
    assert sensor_noise(noise, SWEEP, white) == pytest.approx(SD, rel=0.3)


def test_what_the_model_lacks_stays_beyond_the_noise(rng_seed):
    """Play leaves a square wave whose harmonics lie where noise is looked for.

    The alarm needs an error of 1.5 times the noise; here it is 2.2 times (scatter 2 %).
    """
    rng = np.random.default_rng(rng_seed)
    play = 20e-6 * np.sign(np.gradient(SWEEP))
    error = 2e-6 * rng.standard_normal(SAMPLES) + play
    assert np.std(error) > 2.0 * sensor_noise(error, SWEEP, white_noise(error))
    # Beside as much noise as in the demonstration nothing of it passes for noise.
    loud = 10e-6 * rng.standard_normal(SAMPLES) + play
    assert sensor_noise(loud, SWEEP, white_noise(loud)) == white_noise(loud)
    lag = 20e-6 * np.gradient(SWEEP) / np.abs(np.gradient(SWEEP)).max()
    smooth = 2e-6 * rng.standard_normal(SAMPLES) + lag
    assert sensor_noise(smooth, SWEEP, white_noise(smooth)) < 2.5e-6


def test_too_little_above_the_command_leaves_white_noise():
    quick = np.random.default_rng(0).standard_normal(SAMPLES)
    assert sensor_noise(quick, quick, 1.0) == 1.0
    assert sensor_noise(quick[:60], SWEEP[:60], 0.5) == 0.5


def test_a_healthy_machine_with_a_filtered_transducer_raises_no_alarm(rng_seed):
    """The `noise` band covers 88 % (over seeds +- 1.6 %); taken for white, the noise left 32 %.

    The alarm's limit is 80 %.
    """
    command = random_command(SLOW, 12.0, 0.2, 3.0, seed=rng_seed)
    clean = linear.simulate(THETA, command, stiffness=250e3, period=1.0 / SLOW)
    passed = signal.butter(2, 30.0, fs=SLOW, output='sos')
    drawn = np.random.default_rng(rng_seed).standard_normal(len(clean))
    measured = clean + SD / 0.5 * signal.sosfilt(passed, drawn)
    found = results(stream(replace(record(12.0), command=command, measured=measured)))
    covered = [p.coverage[-1] for r in found for p in r.scored if p.kind == 'noise']
    assert len(covered) >= 15
    assert np.mean(covered) > 0.8
