"""Channels slower than their recorder: told with their rate, and no delay is left of it."""

from dataclasses import replace

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.hygiene import slow_channel
from actuator_glue.inference.least_squares.fit import base_fit
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])
NOISE, RATE = 3e-6, 1000.0


def machine(held_command: Array | None = None, top: float = 6.0, seed: int = 3) -> Record:
    """Return a record of 20 s of a smooth sweep, or of a command in steps, with noise."""
    t = np.arange(int(20 * RATE)) / RATE
    sweep = 2e-3 * np.sin(np.pi * (top / 20.0) * t**2)
    bare = Record(sweep, 0.0 * t, 1 / RATE, stiffness=0.0, hold='linear')
    if held_command is not None:
        bare = replace(bare, command=held_command, hold='zoh')
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(t))
    return replace(bare, measured=Structure(()).simulate(THETA, bare) + noise)


def held(values: Array, every: float, first: float = 0.0) -> Array:
    """Return the readings that a controller takes at each `every`-th sample, from one on."""
    at = np.arange(len(values))
    taken = first + every * np.floor((at - first) / every)
    return np.interp(taken, at, values)


def found(record: Record) -> tuple[Array, float, list[str]]:
    """Return parameters and error of Eq. (2) as a diagnosis sees a record, and what it is told."""
    ready = prepare([record], [])
    fit = base_fit(ready.fit)
    return fit.theta, fit.rms, [note for note in ready.notes if 'one sample of' in note]


@pytest.mark.parametrize('every', [2.0, 5.0, 12.0, 1000.0 / 77.0, 20.0])
@pytest.mark.parametrize('first', [0.0, 1.0])
def test_readings_are_found_where_they_are(every: float, first: float) -> None:
    """Whole numbers of samples apart or not; to within what a sample tells."""
    values = held(machine().measured, every, first)
    known = slow_channel.readings(values)
    assert known is not None
    assert known.every == pytest.approx(every, rel=1e-4)
    numbers = np.rint((known.times - first) / every)
    assert np.abs(known.times - first - every * numbers).max() < (0.55 if every % 1.0 else 1e-9)
    assert np.array_equal(np.diff(numbers), np.ones(len(numbers) - 1))
    curve = slow_channel.smooth(values, known)
    inside = curve[known.samples[1:-1]] - values[known.samples[1:-1]]
    assert every % 1.0 or np.abs(inside).max() < 1e-12


def test_nothing_is_made_up_beyond_the_readings() -> None:
    """A fast motion to the last sample: what is filled is within a micrometre of it everywhere."""
    record = machine(top=3.0)
    silent = replace(record, measured=Structure(()).simulate(THETA, record))
    stepped = replace(silent, measured=held(silent.measured, 20.0, 7.0))
    (filled,), _ = slow_channel.measured_filled([stepped])
    assert len(record) - 20 < len(filled) <= len(record) - 7
    offset = round((filled.start_ns - record.start_ns) * 1e-9 * RATE)
    truth = silent.measured[offset : offset + len(filled)]
    assert offset == 7
    assert np.abs(filled.measured - truth).max() < 3e-6


@pytest.mark.parametrize('grid', np.geomspace(2e-6, 1e-3, 12))
@pytest.mark.parametrize('rate', [250.0, 1000.0, 2000.0, 10_000.0])
def test_coarse_channels_are_not_slow(grid: float, rate: float) -> None:
    """A converter's step repeats readings at no regular times; noise never repeats one."""
    t = np.arange(int(20 * rate)) / rate
    y = 2e-3 * np.sin(np.pi * 0.4 * t**2)
    y += NOISE * np.random.default_rng(7).standard_normal(len(t))
    assert slow_channel.readings(grid * np.round(y / grid)) is None
    assert slow_channel.readings(y) is None
    assert slow_channel.readings(np.zeros(len(t))) is None


@pytest.mark.parametrize('every', [2.0, 5.0, 1000.0 / 77.0, 20.0])
def test_a_slow_measured_channel_leaves_no_delay(every: float) -> None:
    """Parameters are those of the whole channel; the staircase moves them by a tenth and more."""
    record = machine()
    whole, _, nothing = found(record)
    theta, _, (note,) = found(replace(record, measured=held(record.measured, every)))
    assert nothing == []
    assert f'of {every:.4g} only' in note and f'gives {RATE / every:.4g} Hz of 1000' in note
    assert theta[0] == pytest.approx(whole[0], rel=0.02)


@pytest.mark.parametrize('every', [5.0, 1000.0 / 77.0, 20.0])
@pytest.mark.parametrize('both', [False, True])
def test_a_command_that_is_recorded_in_steps_runs_between_them(every: float, both: bool) -> None:
    """The actuator followed what nobody recorded; in what is recorded it leads by half a step."""
    record = machine()
    measured = held(record.measured, every) if both else record.measured
    stepped = replace(record, command=held(record.command, every), measured=measured, hold='zoh')
    theta, rms, notes = found(stepped)
    assert len(notes) == 1 + both
    assert 'in place of its steps Eq. (2) leaves' in notes[-1]
    assert theta[0] == pytest.approx(THETA[0], rel=0.03)
    assert rms < 1.2 * NOISE


def test_a_command_that_is_held_stays_held() -> None:
    """A controller of 50 Hz: its steps are real, and said to be; samples are not touched."""
    command = held(machine().command, 20.0)
    record = machine(command)
    (kept,), notes = slow_channel.command_filled([record], ['rest'])
    assert kept is record
    assert 'its steps are taken as they are' in notes[0]
    assert found(record)[0][0] == pytest.approx(THETA[0], rel=0.03)


@pytest.mark.parametrize(('every', 'rate'), [(10.0, 125.0), (20.0, 50.0), (2.0, 1000 / 3)])
def test_readings_are_fitted_at_no_more_than_their_rate(every: float, rate: float) -> None:
    """Between them is nothing new: noise drawn out over many samples left sizes open."""
    record = machine(top=4.0)
    ready = prepare([replace(record, measured=held(record.measured, every))], [])
    (fitted,) = ready.fit.records
    assert fitted.rate == pytest.approx(rate)
    assert any('measured channel gives: means' in note for note in ready.notes) == (rate < 300.0)


@pytest.mark.slow
def test_a_calibration_is_told_too() -> None:
    """The same record, the same answer, in seconds."""
    record = machine()
    channels = (held(c, 20.0) for c in (record.command, record.measured))
    stepped = replace(
        record, **dict(zip(('command', 'measured'), channels, strict=True)), hold='zoh'
    )
    answer = ag.calibrate(stepped.slice(0, 6000), evaluations=6000)
    assert sum('one sample of 20 only' in note for note in answer.notes) == 2
    assert answer.error.rms_m < 1.5 * NOISE


@pytest.mark.slow
def test_a_diagnosis_of_held_channels_finds_nothing_that_is_not_there() -> None:
    """Steps of a record alone sent the search through all effects, for minutes."""
    record = machine()
    channels = (held(c, 20.0) for c in (record.command, record.measured))
    stepped = replace(
        record, **dict(zip(('command', 'measured'), channels, strict=True)), hold='zoh'
    )
    answer = ag.diagnose(stepped, jobs=1)
    assert answer.verdict == 'none'
    assert answer.seconds < 60.0


@pytest.mark.slow
def test_play_is_found_with_its_size_in_channels_that_are_held() -> None:
    """A command of 50 Hz and readings of 100 Hz in a log of 1 kHz: it was 26 to 976 um."""
    command, records = ag.Command(rate=RATE, duration=20.0, high=6.0), []
    for k, seed in ((0.0, 1), (250e3, 2)):
        made = ag.simulate(command, stiffness=k, seed=seed, effects=['backlash'], hold='linear')
        stepped = replace(made, command=held(made.command, 20.0), hold='zoh', force=None)
        records.append(replace(stepped, measured=held(made.measured, 10.0)))
    answer = ag.diagnose(records, jobs=2)
    (found,) = answer.effects
    size = found.parameters['backlash']
    assert found.name == 'backlash'
    assert size.lower < 41.4e-6 < size.upper < 1.05 * size.lower
