"""Records are checked, zeroed and split before any look."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.records import Record
from actuator_glue.residual.hygiene import prepare

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
        (replace(GOOD, command=1e3 * U, measured=900 * U), 'm/s; check the units'),
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
    both = prepare([resting], [resting])
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


def test_fast_records_are_compared_at_every_nth_sample() -> None:
    """1 kHz is simulated whole and counted at 333 Hz."""
    t = np.arange(0, 10, 1e-3)
    u = 2e-3 * np.sin(t)
    fast = Record(u, 0.9 * u, 1e-3, stiffness=0.0)
    data = prepare([fast], [fast]).fit
    assert data.strides == (3,)
    assert data.periods == (pytest.approx(3e-3),)
    assert data.target.size == len(range(0, 10000, 3))


def test_a_record_that_begins_in_motion_starts_from_its_samples() -> None:
    """The first second then only lets the state be forgotten."""
    data = prepare([GOOD.slice(1000, 5000)], [GOOD]).fit
    assert data.initials == ('measured',)
    assert not data.masks[0][:256].any()
