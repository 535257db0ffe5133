"""Samples given twice: copies in fewer digits, parts, priors; tests of one command are none."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy

import actuator_glue as ag
from actuator_glue.api.simulation import Sensors
from actuator_glue.errors import InputError
from actuator_glue.hygiene.repeats import refuse_known, refuse_repeats, sketch
from actuator_glue.records import Array, Record

RATE = 256.0
T = np.arange(0, 20, 1 / RATE)
U = 2e-3 * np.sin(np.pi / 8 * T**2)


def trial(seed: int, noise: float = 5e-6) -> Record:
    """Return a test of one command on one machine, its noise its own."""
    measured = 0.9 * U + noise * np.random.default_rng(seed).standard_normal(len(U))
    return Record(U, measured, 1 / RATE, stiffness=0.0, source=f'test {seed}')


ONE = trial(1)


def digits(values: Array, count: int, unit: float = 1e-3) -> Array:
    """Return values as a table of so many significant digits has them [m]."""
    return unit * np.array([float(f'{v / unit:.{count}g}') for v in values])


@pytest.mark.parametrize(
    'copied',
    [
        lambda y: digits(y, 3),
        lambda y: digits(y, 5),
        lambda y: digits(y, 4, 0.0254),
        lambda y: 1e-5 * np.round(y / 1e-5),
        lambda y: 1e-3 * (1e3 * y).astype(np.float32).astype(np.float64),
        lambda y: y[1000:4000],
        lambda y: digits(y, 4)[2000:],
    ],
    ids=['3 digits', '5 digits', 'inches', '10 um', 'single', 'a part', 'the end, 4 digits'],
)
def test_a_copy_is_known_by_its_noise(copied: Callable[[Array], Array]) -> None:
    """However it was written, in whatever order, fitted or held out."""
    measured = copied(ONE.measured)
    copy = replace(ONE.slice(0, len(measured)), measured=measured, source='copy')
    for pair in ([ONE, copy], [copy, ONE]):
        with pytest.raises(InputError, match=r'holds the same samples as .* would count twice'):
            refuse_repeats(pair)
    with pytest.raises(InputError, match=r'copy, held out, .* it would judge itself'):
        refuse_repeats([trial(2), ONE], [copy])
    with pytest.raises(InputError, match=r'the prior from monday\.npz was made'):
        refuse_known([trial(2), copy], [sketch(ONE)], 'monday.npz')


@pytest.mark.parametrize(('gain', 'zero'), [(1.0, 1e-3), (-1.0, 0.0), (1.02, -2e-4)])
@pytest.mark.parametrize('count', [6, None], ids=['6 digits', 'full'])
def test_another_zero_sign_or_gain_is_no_other_test(
    gain: float, zero: float, count: int | None
) -> None:
    """Both channels shifted and scaled, whole or in part; another test's copy is no copy."""

    def made(record: Record) -> Record:
        measured = gain * record.measured + zero
        measured = measured if count is None else digits(measured, count)
        command = gain * record.command + zero
        return replace(record, command=command, measured=measured, source='copy')

    for copy in (made(ONE), made(ONE).slice(700, 2900)):
        for pair in ([ONE, copy], [copy, ONE]):
            with pytest.raises(InputError, match='would count twice'):
                refuse_repeats(pair)
        with pytest.raises(InputError, match='it would judge itself'):
            refuse_repeats([ONE], [copy])
        with pytest.raises(InputError, match='the prior from monday'):
            refuse_known([copy], [sketch(ONE)], 'monday.npz')
    refuse_repeats([trial(2), made(ONE)])
    refuse_known([made(ONE)], [sketch(trial(2))], 'monday.npz')


@pytest.mark.parametrize('shape', ['sine', 'sweep', 'noise'])
@pytest.mark.parametrize('count', [5, None], ids=['5 digits', 'full'])
def test_machines_without_noise_are_no_copies(shape: str, count: int | None) -> None:
    """A linear one moves alike in all sizes, and a sine alike whatever its parameters."""
    made = []
    for amplitude, stiffness in ((2e-3, 0.0), (1e-3, 0.0), (2e-3, 250e3), (2e-3, 260e3)):
        command = ag.Command(shape, rate=250.0, duration=8.0, amplitude=amplitude)
        quiet = Sensors(noise=0.0, force_noise=0.0)
        test = ag.simulate(command, stiffness=stiffness, sensors=quiet)
        measured = test.measured if count is None else digits(test.measured, count)
        made.append(replace(test, measured=measured))
    refuse_repeats(made)


@pytest.mark.parametrize(('gain', 'zero'), [(1.0, 1e-4), (-1.0, 0.0), (2.0, 0.0)])
@pytest.mark.parametrize(('size', 'step'), [(1e-3, 1e-5), (1e-3, 1e-4), (1e-2, 1e-4)])
def test_coarse_channels_that_show_no_noise_are_no_copies(
    gain: float, zero: float, size: float, step: float
) -> None:
    """Triangles of two tests, written in steps that are far coarser than their noise."""
    time = np.arange(2000) / 1000.0
    motion = size * (2.0 * np.abs((2.0 * time) % 2.0 - 1.0) - 1.0)
    wave = 2.0 * np.pi * 15.0
    tops, bottoms, _ = scipy.signal.cont2discrete(([wave**2], [1.0, 1.8 * wave, wave**2]), 1e-3)
    lag = scipy.signal.lfilter(tops.ravel(), bottoms, motion)
    noise = 1e-6 * np.random.default_rng(0).standard_normal((2, 2000))
    tests = [
        Record(g * motion, step * np.rint((g * lag + z + n) / step), 1e-3, stiffness=0.0)
        for g, z, n in ((1.0, 0.0, noise[0]), (gain, zero, noise[1]))
    ]
    refuse_repeats(tests)
    if gain > 0.0:  # half a period later a triangle is its mirror image
        refuse_known([tests[1]], [sketch(tests[0])], 'monday.npz')


def test_every_second_sample_is_no_other_test() -> None:
    """At half the rate."""
    thin = replace(ONE.slice(0, 2560), measured=ONE.measured[1::2], period=2 / RATE)
    with pytest.raises(InputError, match='would count twice'):
        refuse_repeats([thin, ONE])


@pytest.mark.parametrize('noise', [1e-7, 1e-6, 1e-5])
@pytest.mark.parametrize('step', [0.0, 2e-7, 5e-6])
def test_a_command_that_is_repeated_is_another_test(noise: float, step: float) -> None:
    """The same motion with fresh noise, whatever the digits and the converter's step."""
    if step > 5.0 * noise:
        pytest.skip('a converter that reads no noise at all says nothing')
    tests = []
    for seed in (1, 2):
        test = trial(seed, noise)
        if step:
            test = replace(test, measured=step * np.round(test.measured / step))
        tests.append(test)
    few = replace(tests[1], measured=digits(tests[1].measured, 4))
    for other in (tests[1], few):
        refuse_repeats([tests[0], other])
        refuse_known([other], [sketch(tests[0])], 'monday.npz')


def test_readings_that_rest_are_no_copy() -> None:
    """A converter that shows three values at rest, in both tests, before other motion."""
    rest = 5e-6 * np.round(np.random.default_rng(3).standard_normal(1024) / 3.0)
    made = [
        replace(
            ONE.slice(0, 3024),
            command=np.append(0 * rest, scale * U[:2000]),
            measured=np.append(rest, trial(seed).measured[:2000] * scale),
        )
        for seed, scale in ((4, 1.0), (5, 0.8))
    ]
    refuse_repeats(made)


def test_a_prior_of_the_same_records_is_refused() -> None:
    """By calibration and diagnosis, also from the file it was saved to."""
    record = ag.simulate(ag.Command(rate=100.0, duration=8.0), stiffness=250e3, seed=4)
    posterior = ag.calibrate(record, evaluations=8000, seed=1)
    few = replace(record, measured=digits(record.measured, 5))
    for use in (ag.calibrate, ag.diagnose):
        with pytest.raises(InputError, match='the prior from a calibration was made'):
            use(few, prior=posterior)
