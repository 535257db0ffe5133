"""Records are checked, zeroed and split before any look."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

import actuator_glue as ag
from actuator_glue.diagnosis.samples.preparation import prepare
from actuator_glue.errors import InputError
from actuator_glue.hygiene.checks import beside_stated, check
from actuator_glue.hygiene.clean import clean, initial_state
from actuator_glue.hygiene.suspicions import suspicions
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

T = np.arange(0, 20, 1 / 256)
U = 2e-3 * np.sin(np.pi / 4 * T**2)
GOOD = Record(U, 0.9 * U, 1 / 256, stiffness=0.0, source='good')


@pytest.mark.parametrize(
    ('record', 'says'),
    [
        (replace(GOOD, stiffness=None), 'stiffness'),
        (GOOD.slice(0, 600), 'too short'),
        (replace(GOOD, command=0 * U), 'command is constant'),
        (replace(GOOD, measured=0 * U + 1e-3), 'channel is connected'),
        (replace(GOOD, measured=900 * U), 'units'),
        (replace(GOOD, command=1e3 * U, measured=900 * U), 'have 2 m; check the units'),
        (replace(GOOD, command=1e-3 * U, measured=9e-4 * U), 'check the units'),
        (replace(GOOD, measured=-0.9 * U), 'change the sign'),
        (replace(GOOD, measured=np.append(U[8:], np.zeros(8))), 'leads the command by 31 ms'),
    ],
)
def test_unusable_records_say_why(record: Record, says: str) -> None:
    """One error that names the record and the fault."""
    with pytest.raises(InputError, match=says) as error:
        prepare([record], [])
    assert 'good' in str(error.value)


def test_a_periodic_command_has_no_lag_to_judge() -> None:
    """A sine that lags by 200 degrees looks as if it led by 160: nothing is refused for it."""
    u = 2e-3 * np.sin(2 * np.pi * 4.0 * T)
    y = 1e-3 * np.sin(2 * np.pi * 4.0 * T - np.deg2rad(200.0))
    prepare([Record(u, y, 1 / 256, stiffness=0.0)], [])


def test_no_record_is_an_error() -> None:
    """Nothing to diagnose."""
    with pytest.raises(InputError, match='no record'):
        prepare([], [])


def test_rest_offsets_go_only_where_all_records_rest() -> None:
    """The zero of the day is removed from all records or from none."""
    rest = np.zeros(2 * 256)
    resting = Record(
        np.concatenate([rest, U]) + 1e-4,
        np.concatenate([rest, 0.9 * U]) + 3e-4,
        1 / 256,
        stiffness=0.0,
    )
    again = replace(resting, measured=1.01 * resting.measured)
    both = prepare([resting], [again])
    assert both.fit.records[0].measured[:100] == pytest.approx(0.0, abs=1e-12)
    assert both.held.records[0].command[:100] == pytest.approx(0.0, abs=1e-12)
    assert len(both.notes) == 2
    one = prepare([resting], [GOOD])
    assert one.fit.records[0].measured[0] == pytest.approx(3e-4)


def test_without_a_held_out_record_blocks_are_set_aside() -> None:
    """Fitting and held-out samples share none and cover all."""
    prepared = prepare([GOOD], [])
    fit, held = prepared.fit.masks[0], prepared.held.masks[0]
    assert not (fit & held).any()
    assert (fit | held).all()
    assert 0.2 < held.mean() < 0.3


def test_a_record_that_begins_in_motion_starts_from_its_samples() -> None:
    """The first second then only lets the state be forgotten."""
    data = prepare([GOOD.slice(1000, 5000)], [replace(GOOD, measured=0.95 * U)]).fit
    assert data.initials == ('measured',)
    assert not data.masks[0][:256].any()


def test_an_offset_of_the_transducer_leaves_the_start_at_rest() -> None:
    """0.3 mm between two zeros, more than a twentieth of the range, say nothing of motion."""
    assert initial_state(replace(GOOD, measured=GOOD.measured + 3e-4)) == 'rest'


def test_a_zero_crossing_at_speed_is_no_rest() -> None:
    """Command and displacement near zero, and both on their way."""
    t = T[: 10 * 256]
    u = 2e-3 * np.sin(2 * np.pi * 3.0 * t)
    assert initial_state(Record(u, 0.9 * u, 1 / 256)) == 'measured'


@pytest.mark.parametrize(
    ('records', 'held', 'says'),
    [
        ([GOOD, replace(GOOD, source='copy', stiffness=250e3)], [], 'copy holds the same samples'),
        ([GOOD], [replace(GOOD, source='copy')], 'copy, held out, .* would judge itself'),
    ],
)
def test_records_given_twice_are_refused(
    records: list[Record], held: list[Record], says: str
) -> None:
    """The samples decide, whatever the records are called."""
    with pytest.raises(InputError, match=says):
        prepare(records, held)


def pushed(stiffness: float, mass: float = 0.0, **changes: object) -> Record:
    """A specimen and a mass under a sweep, the force as a load cell shows it."""
    y = np.asarray(GOOD.measured)
    force = stiffness * y + mass * np.gradient(np.gradient(y, 1 / 256), 1 / 256)
    force = force + 20.0 * np.random.default_rng(1).standard_normal(len(y)) + 150.0
    return replace(GOOD, stiffness=stiffness, force=force, **changes)


@pytest.mark.parametrize('wrong', [250.0, 250e6, 0.0])
def test_a_stiffness_that_the_force_contradicts_is_refused(wrong: float) -> None:
    """250 kN/m by force over displacement, whatever the sign of the load cell."""
    record = pushed(250e3, 50.0)
    for sign in (1.0, -1.0):
        check(replace(record, force=sign * np.asarray(record.force)))
        with pytest.raises(InputError, match=r'force over displacement is 2\.[45]\d*e\+05 N/m'):
            check(replace(record, force=sign * np.asarray(record.force), stiffness=wrong))


def test_a_force_that_says_nothing_stops_nobody() -> None:
    """Inertia of a free actuator, noise, a channel that is not connected."""
    check(pushed(0.0, 500.0))
    check(pushed(0.0))
    check(replace(pushed(250e3), force=np.full(len(T), 150.0)))
    noise = 1e3 * np.random.default_rng(2).standard_normal(len(T))
    check(replace(GOOD, stiffness=250e3, force=noise))


@pytest.mark.parametrize(('effect', 'stiffness'), [('coulomb-friction', 0.0), ('', 1e5)])
def test_friction_between_two_levels_is_no_specimen(effect: str, stiffness: float) -> None:
    """It holds the piston as one would; a specimen that is not stated is refused."""
    rng = np.random.default_rng(6)
    u = 2e-3 * np.sign(np.sin(np.pi * T))
    model = Structure([effect] if effect else [])
    theta = [*TABLE_2, 300.0] if effect else TABLE_2
    y, force = Stream(model, theta, stiffness=stiffness, period=1 / 256).step(u)
    y = y + 2e-6 * rng.standard_normal(len(u))
    record = Record(u, y, 1 / 256, stiffness=0.0, force=force + 10.0 * rng.standard_normal(len(u)))
    if effect:
        check(record)
    else:
        with pytest.raises(InputError, match=r'force over displacement is 1e\+05 N/m'):
            check(record)


def test_a_specimen_that_no_force_shows_is_told() -> None:
    """Two newtons of noise beside 250 kN/m, or newtons taken for kilonewtons; nothing else is."""
    noise = 2.0 * np.random.default_rng(2).standard_normal(len(T))
    (told,) = suspicions([GOOD, pushed(250e3, 50.0), replace(GOOD, stiffness=250e3, force=noise)])
    assert told.startswith('good: the specimen stiffness is given as 2.5e+05 N/m, and the force')
    loud = pushed(250e3)
    drowned = replace(loud, force=1e-3 * np.asarray(loud.force) + noise)
    assert suspicions([drowned]) and not suspicions([replace(drowned, stiffness=100.0)])
    silent = replace(GOOD, stiffness=250e3, force=np.full(len(T), 150.0))
    deaf = replace(GOOD, stiffness=250e3, force=5e4 * noise)  # it could not show a specimen
    free = replace(GOOD, force=noise)
    assert not suspicions([silent, deaf, free, replace(GOOD, stiffness=250e3)])
    t = T[:2560]
    sine = np.sin(2 * np.pi * 2.0 * t)  # a mass may carry all that the specimen pushes
    steady = Record(2e-3 * sine, 1.8e-3 * sine, 1 / 256, stiffness=250e3, force=noise[:2560])
    assert not suspicions([steady])


@pytest.mark.parametrize('typed', [0.25, 50.0, 250.0, 1000.0])
def test_a_stiffness_of_no_specimen_is_refused(typed: float) -> None:
    """250 kN/m typed in kN/m, N/mm or kN/mm; a soft specimen and none are taken."""
    with pytest.raises(InputError, match=rf'good: the specimen .* {typed:g} N/m.* its unit'):
        prepare([replace(GOOD, stiffness=typed)], [])
    for taken in (0.0, 2e3, 50e3):
        check(replace(GOOD, stiffness=taken))


def amplified(factor: float, stiffness: float) -> Record:
    """A sweep that is followed with a lag of 20 ms, measured in another unit than it says."""
    t = np.clip(T - 0.02, 0.0, None)
    y = factor * 1.9e-3 * np.sin(np.pi / 8 * t**2)
    return Record(2e-3 * np.sin(np.pi / 8 * T**2), y, 1 / 256, stiffness=stiffness, source='it')


@pytest.mark.parametrize(
    ('factor', 'stiffness', 'says'),
    [
        (1.0 / 25.4, 0.0, 'as of inches and millimetres in one unit'),
        (25.4, 250e3, 'as of inches and millimetres in one unit'),
        (1.0 / 25.4, 250e3, r'has 0\.037\d times the amplitude of the command'),
        (0.1, 0.0, 'as of centimetres and millimetres in one unit'),
        (10.0, 250e3, 'as of centimetres and millimetres in one unit'),
    ],
)
def test_two_units_in_one_record_are_refused(factor: float, stiffness: float, says: str) -> None:
    """Slow motion is followed nearly all the way, whatever the actuator."""
    check(amplified(1.0, stiffness))
    with pytest.raises(InputError, match=f'{says}.*check the units of both channels'):
        check(amplified(factor, stiffness))


def test_a_slow_amplitude_far_from_one_is_told() -> None:
    """Half of it, or twice; under a specimen a tenth, which leakage might be. Lag excuses it."""
    for factor, stiffness in ((0.5, 0.0), (2.0, 0.0), (0.5, 250e3), (0.1, 250e3)):
        check(amplified(factor, stiffness))
        (told,) = suspicions([amplified(factor, stiffness)])
        assert told.startswith('it: the measured displacement has ') and 'units' in told
    # A free record that follows all the way shows that the units are right: the rest is leakage.
    assert not suspicions([GOOD, amplified(0.4, 250e3)])
    assert suspicions([GOOD, amplified(0.4, 0.0)]) and suspicions([amplified(0.4, 250e3)])
    slow = scipy.signal.lfilter([0.002], [1.0, -0.998], U)  # a bandwidth of 0.08 Hz
    assert not suspicions([amplified(1.0, 0.0), replace(GOOD, measured=slow)])
    check(replace(GOOD, measured=slow))


@pytest.mark.parametrize(
    ('stated', 'told'), [(250e3, 0), (225e3, 0), (290e3, 0), (125e3, 1), (600e3, 1), (0.0, 0)]
)
def test_a_stiffness_beside_that_of_the_force_is_told(stated: float, told: int) -> None:
    """A factor of two is no refusal, and no silence; a tenth is a load cell's."""
    record = ag.simulate(
        ag.Command(rate=250.0, duration=8.0, high=6.0),
        stiffness=250e3 if stated else 0.0,
        seed=3,
    )
    _, notes = clean([replace(record, stiffness=stated)])
    found = [note for note in notes if 'force over displacement tells' in note]
    assert len(found) == told
    assert all(f'2.5e+05 N/m, and {stated:.3g} N/m is given' in note for note in found)
    # A force that shows little tells nothing.
    noise = np.random.default_rng(4).normal(0.0, 2.0 * np.std(record.force), len(record))
    doubtful = replace(record, stiffness=stated, force=record.force + noise)
    if stated:
        assert not [n for n in clean([doubtful])[1] if 'force over displacement tells' in n]


@pytest.mark.parametrize(
    ('effect', 'stiffness', 'command'),
    [
        ('sensor-curve', 50e3, ag.Command('sweep', duration=20.0, amplitude=0.01)),
        ('specimen-hardening', 250e3, ag.Command('sweep', duration=20.0, amplitude=0.01)),
        ('specimen-gap', 250e3, ag.Command('noise', duration=20.0)),
        ('specimen-gap', 1e6, ag.Command('sine', duration=10.0, high=8.0)),
        ('stribeck-friction', 50e3, ag.Command('sine', duration=10.0, high=2.0)),
    ],
)
def test_a_slope_that_depends_on_the_motion_is_no_other_stiffness(
    effect: str, stiffness: float, command: ag.Command
) -> None:
    """Rightly stated: what bends the force is left to the diagnosis."""
    assert not beside_stated([ag.simulate(command, stiffness=stiffness, effects=[effect])])


@pytest.mark.parametrize(
    'command',
    [
        ag.Command('sweep', duration=20.0),
        ag.Command('noise', duration=20.0),
        ag.Command('earthquake', duration=20.0),
    ],
)
@pytest.mark.parametrize(('stated', 'unit'), [(125e3, 1.0), (250e3, 1.0 / 4.448)])
def test_one_stiffness_that_is_not_the_stated_one_is_told(
    command: ag.Command, stated: float, unit: float
) -> None:
    """Half of it, or a force in lbf that is read as one in N."""
    record = ag.simulate(command, stiffness=250e3, seed=3)
    assert record.force is not None
    (told,) = beside_stated([replace(record, stiffness=stated, force=unit * record.force)])
    assert 'small and large motion agree' in told
