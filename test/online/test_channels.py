"""Channels of a stream that cannot be what they are said to be; good streams are left alone."""

from dataclasses import replace

import numpy as np
import pytest
from online_streams import RATE, block, record, setup, stream

from actuator_glue.model import linear
from actuator_glue.model.commands import noise
from actuator_glue.online.channels import ChannelFault, fault
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.windows import SlidingWindows
from actuator_glue.records import Record

GOOD = record(5.0)
PUSHES = replace(GOOD, force=250e3 * GOOD.measured)
TIME = np.arange(1000) / RATE


def moved(command, rate=RATE):
    """What Eq. (2) measures of a command."""
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    clean = linear.simulate(theta, command, stiffness=250e3, period=1.0 / rate)
    measured = clean + 1e-5 * np.random.default_rng(2).standard_normal(len(clean))
    return replace(GOOD, command=command, measured=measured, period=1.0 / rate)


def scaled(of, factor):
    """Both displacements in another unit."""
    return replace(of, command=factor * of.command, measured=factor * of.measured)


@pytest.mark.parametrize(
    ('stretch', 'told'),
    [
        (replace(GOOD, command=GOOD.measured, measured=GOOD.command), 'swapped'),
        (replace(GOOD, measured=-GOOD.measured), 'change the sign'),
        (replace(GOOD, measured=10.0 * GOOD.measured), 'units of both channels'),
        (replace(GOOD, measured=400.0 * GOOD.measured), 'units of both channels'),
        (scaled(GOOD, 1e3), 'a column in millimetres'),
        (scaled(GOOD, 400.0), 'units of its channel'),
        (scaled(PUSHES, 50.0), 'units of the force channel'),
        (scaled(PUSHES, 1.0 / 25.4), 'units of the force channel'),
        (replace(GOOD, stiffness=250.0), 'in N/m'),
    ],
)
def test_what_a_file_may_not_have_is_told_of_a_stream(stretch, told):
    assert told in fault(stretch)


def test_an_angle_is_told_in_its_own_unit():
    told = fault(replace(scaled(GOOD, 1e3), stiffness=0.0, motion='deg'))
    assert 'kdeg' in told and ' m ' not in told


def test_a_fast_stream_is_judged_as_any_other():
    fast = record(5.0, rate=20_000.0)
    assert fault(fast) == ''
    assert 'swapped' in fault(replace(fast, command=fast.measured, measured=fast.command))


@pytest.mark.parametrize(
    'command',
    [
        2e-3 * np.sin(2.0 * np.pi * 1.0 * TIME),
        2e-3 * np.sin(2.0 * np.pi * 0.05 * TIME),
        1e-4 * np.sin(2.0 * np.pi * 6.0 * TIME),
        2e-3 * np.sin(2.0 * np.pi * 1.0 * TIME * TIME),
        1e-3 * TIME,
        0.05 * np.sin(2.0 * np.pi * 0.3 * TIME),
    ],
)
def test_nothing_is_said_of_a_good_stream(command):
    assert fault(moved(command)) == ''
    assert fault(replace(PUSHES, force=-PUSHES.force)) == ''


@pytest.mark.parametrize(
    'command',
    [
        0.0 * TIME,
        1e-6 * np.sin(2.0 * np.pi * 1.0 * TIME),
        1e-6 * TIME,
        2e-3 * (TIME > 2.5),
        2e-3 * (TIME > 0.0),
        2e-3 * (TIME > 4.98),
        np.where(TIME > 4.5, 1e-3 * np.sin(2.0 * np.pi * 3.0 * TIME), 0.0),
        2e-3 * np.clip(2.0 * TIME - 4.0, 0.0, 1.0),
    ],
)
@pytest.mark.parametrize('noise', [0.0, 1e-6, 2e-5])
@pytest.mark.parametrize('grid', [1e-7, 1e-5])
def test_where_the_command_rests_or_holds_nothing_is_judged(command, noise, grid):
    """By hand: a sensor that shows its last digit, or nothing, is none that is not connected."""
    given = moved(command)
    command = command + noise * np.random.default_rng(1).standard_normal(1000)
    assert (
        fault(replace(given, command=command, measured=grid * np.round(given.measured / grid)))
        is None
    )


@pytest.mark.parametrize(
    'command', [2e-3 * TIME, 2e-2 * np.sin(0.06 * np.pi * (TIME + 12.0)), 1e-3 * np.sin(TIME)]
)
def test_in_one_stroke_a_force_that_drifts_says_nothing(command):
    """A load cell of 250 kN that warms up beside a free actuator, and friction where it turns."""
    free = replace(moved(command), stiffness=0.0)
    assert fault(replace(free, force=500.0 * TIME)) == ''
    assert fault(replace(free, force=3e3 * np.sign(np.gradient(free.command)))) == ''
    assert 'given as 0 N/m' in fault(replace(PUSHES, stiffness=0.0))


def test_a_fault_stands_from_two_stretches_on_until_one_is_good():
    channels = ChannelFault()
    said = []
    for found in ('swapped by 3 ms', None, 'swapped by 4 ms', 'swapped', None, '', 'swapped'):
        channels.take(found)
        said.append(channels.fault)
    assert said == ['', '', 'swapped by 4 ms', 'swapped by 4 ms', 'swapped by 4 ms', '', '']


@pytest.mark.parametrize('stiffness', [5e6, 20e6])
def test_a_specimen_stiffer_than_the_oil_is_no_other_unit(stiffness):
    """A fifth of such stretches seemed of other units; with a force, a real one is found."""
    rng, odd = np.random.default_rng(3), 0
    for seed in range(20):
        theta = rng.uniform([80.0, 6e8, 1.5e5, 0.5], [200.0, 1.8e9, 4e5, 6.0])
        command = noise(RATE, 12.0, 0.2, 8.0, seed=seed)
        clean = linear.simulate(theta, command, stiffness=stiffness, period=1.0 / RATE)
        measured = clean + 1e-6 * rng.standard_normal(len(clean))
        whole = Record(command, measured, 1.0 / RATE, stiffness, force=stiffness * clean)
        stretch = whole.slice(1000, 2000)
        assert fault(stretch) in ('', None)
        odd += bool(fault(replace(stretch, measured=stretch.measured / 25.4)))
    assert odd > 15


@pytest.mark.parametrize('force', [True, False])
def test_stretches_share_no_sample_and_are_whole(force):
    settings = EstimatorSettings(window=0.5, hop=0.2, settle=0.0, time_budget=0.1)
    windows = SlidingWindows(settings)
    windows.setup(setup())
    given = record(17.0)
    given = replace(given, force=250e3 * given.measured) if force else given
    found = [w for one in list(stream(given, 7))[1:] for w in windows.push(one)[1]]
    stretches = [w.stretch for w in found if w.stretch is not None]
    assert [s.first_index for s in stretches] == [0, 1000, 2000]
    for one in stretches:
        part = slice(one.first_index, one.first_index + 1000)
        assert np.array_equal(one.measured, given.measured[part])
        assert (one.force is not None) == force
        assert not force or np.array_equal(one.force, given.force[part])
    # What judges forecasts is no longer for it.
    assert max(len(w.recent) for w in found) == 100


def test_a_stretch_of_the_slowest_stream_is_more_than_a_sample():
    windows = SlidingWindows(EstimatorSettings(window=30.0, hop=5.0, settle=0.0))
    windows.setup(setup(period=10.0))
    _, found = windows.push(block(0, 6, period=10.0))
    assert [len(w.stretch) for w in found if w.stretch is not None] == [2, 2]
