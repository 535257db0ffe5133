"""A record of arrays: units and times as laboratories have them, never guessed."""

from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import numpy as np
import pandas as pd
import pytest

import actuator_glue as ag

TIME = np.arange(50) / 200.0
U, X, F = np.sin(TIME), np.sin(TIME - 0.01), 3.0 * np.cos(TIME)
START = np.datetime64('2024-03-01T12:00:00.25', 'ns')


@pytest.mark.parametrize(
    ('unit', 'metre'), [('m', 1.0), ('mm', 1e-3), ('um', 1e-6), ('in', 0.0254)]
)
def test_lengths_and_forces_become_si(unit: str, metre: float) -> None:
    """Every channel with the factor of its own unit; the rate is that of the times."""
    made = ag.Record.from_arrays(TIME, U, X, F, unit=unit, force_unit='kN', stiffness=250e3)
    np.testing.assert_allclose(made.command, U * metre, rtol=1e-15)
    np.testing.assert_allclose(made.measured, X * metre, rtol=1e-15)
    assert made.force is not None
    np.testing.assert_allclose(made.force, 1e3 * F, rtol=1e-15)
    assert (made.period, made.stiffness, made.hold, made.start_ns) == (1 / 200, 250e3, 'zoh', 0)
    bare = ag.Record.from_arrays(TIME + 5.0, U, X, unit=unit, hold='linear')
    assert bare.force is None and bare.stiffness is None and bare.hold == 'linear'
    assert bare.start_ns == 5_000_000_000


@pytest.mark.parametrize(
    'time',
    [
        START + (1e9 * TIME).astype('timedelta64[ns]'),
        pd.Series(pd.to_datetime((1e9 * TIME).astype(np.int64) + int(START.astype(np.int64)))),
        pd.date_range('2024-03-01T12:00:00.25', periods=50, freq='5ms'),
        pd.date_range('2024-03-01T13:00:00.25+01:00', periods=50, freq='5ms'),
        [datetime(2024, 3, 1, 12, 0, 0, 250_000) + timedelta(seconds=t) for t in TIME],
        [
            datetime(2024, 3, 1, 11, 0, 0, 250_000, timezone(-timedelta(hours=1)))
            + timedelta(seconds=t)
            for t in TIME
        ],
    ],
    ids=['numpy', 'pandas', 'index', 'zoned', 'datetime', 'zoned-datetime'],
)
def test_dates_are_times(time: Any) -> None:
    """The period of their steps, and the start in UTC."""
    made = ag.Record.from_arrays(time, U, X, unit='mm')
    assert made.period == 1 / 200
    assert made.start_ns == int(START.astype(np.int64))
    assert datetime.fromtimestamp(made.start_ns * 1e-9, UTC).hour == 12


def test_an_angle_comes_with_its_torque() -> None:
    """Newton metres where newtons stand; of a displacement there is no torque."""
    made = ag.Record.from_arrays(TIME, U, X, F, unit='deg', force_unit='kNm')
    assert made.motion == 'deg' and made.force is not None
    np.testing.assert_allclose(made.force, 1e3 * F, rtol=1e-15)
    with pytest.raises(ag.InputError, match="force_unit 'kNm' is not known; use one of N, "):
        ag.Record.from_arrays(TIME, U, X, F, unit='mm', force_unit='kNm')


def test_columns_of_a_table_and_lists_are_arrays() -> None:
    """What pandas and Python hold is the same record."""
    table = pd.DataFrame({'t': TIME, 'u': U, 'x': X})
    one = ag.Record.from_arrays(table.t, table.u, table.x, unit='mm')
    other = ag.Record.from_arrays(TIME.tolist(), U.tolist(), X.tolist(), unit='mm')
    passed = ag.Record.from_arrays(pd.to_timedelta(TIME, unit='s'), U, X, unit='mm')
    for made in (other, passed):
        np.testing.assert_array_equal(one.measured, made.measured)
        assert one.period == made.period == 1 / 200


@pytest.mark.parametrize('shape', [(-1, 1), (1, -1)])
def test_columns_and_rows_of_matlab_are_arrays(shape: tuple[int, int]) -> None:
    """`scipy.io.loadmat` gives nothing else."""
    given = [v.reshape(shape) for v in (TIME, U, X, F)]
    masked = np.ma.array(X, mask=False).reshape(shape)
    made = ag.Record.from_arrays(*given, unit='mm')
    usual = ag.Record.from_arrays(TIME, U, X, F, unit='mm')
    for one in (made, ag.Record.from_arrays(TIME, given[1], masked, unit='mm')):
        np.testing.assert_array_equal(one.measured, usual.measured)
        assert one.period == usual.period
    table = pd.DataFrame({'u': U})
    np.testing.assert_array_equal(
        ag.Record.from_arrays(TIME, table, X, unit='mm').command, usual.command
    )


@pytest.mark.parametrize(
    ('change', 'told'),
    [
        (
            {'unit': 'parsec'},
            r"unit 'parsec' is not known; use one of m, cm, mm.* deg, .* counts, .* V, ",
        ),
        ({'unit': None}, 'unit None'),
        ({'force_unit': 'kg'}, "force_unit 'kg'"),
        ({'time': np.cumsum(0.005 + 0.004 * np.sin(np.arange(50.0)))}, r'jittered.*resample='),
        ({'time': TIME[::-1]}, 'time goes back'),
        ({'time': np.delete(np.arange(60), range(20, 30)) / 200.0}, 'without samples'),
        ({'time': TIME[:-1]}, 'command has 50 samples, time has 49'),
        ({'measured': X[:-1]}, 'measured has 49 samples, time has 50'),
        ({'time': np.tile(TIME, (2, 1))}, 'one-dimensional'),
        ({'command': np.tile(U, (2, 1))}, 'one-dimensional'),
        ({'command': [[1.0], [2.0, 3.0]]}, 'command is not a list of numbers'),
        ({'time': ['a'] * 50}, 'no list of seconds'),
        ({'time': 0.005}, 'one-dimensional'),
        ({'time': np.full(50, np.datetime64('NaT', 'ns'))}, 'no date at sample 0'),
        ({'time': []}, 'sample'),
        ({'command': ['x'] * 50}, 'command is not a list of numbers'),
        ({'measured': np.where(np.arange(50) == 7, np.nan, X)}, 'first at sample 7'),
        ({'stiffness': -1.0}, 'outside'),
        ({'command': 1e5 * U}, 'beyond 10 m'),
    ],
)
def test_what_cannot_be_used_is_refused(change: dict[str, Any], told: str) -> None:
    """In one line that says which argument, and where."""
    usual: dict[str, Any] = {'time': TIME, 'command': U, 'measured': X, 'force': F, 'unit': 'mm'}
    with pytest.raises(ag.InputError, match=told):
        ag.Record.from_arrays(**usual | change)


def test_a_unit_is_never_guessed() -> None:
    """Nobody is taken to have meant metres."""
    with pytest.raises(TypeError, match='unit'):
        ag.Record.from_arrays(TIME, U, X)  # type: ignore[call-arg]  # that is the fault


@pytest.mark.parametrize('wrap', [list, tuple, lambda v: np.array(v, dtype=object), pd.Series])
def test_complex_numbers_are_refused_in_whatever_holds_them(wrap: Any) -> None:
    """Of a list the real parts had been taken."""
    values = [np.complex128(1e-3 + 1j), np.complex128(2e-3), np.complex128(0.0)]
    with pytest.raises(ag.InputError, match='measured is not a list of numbers'):
        ag.Record.from_arrays([0.0, 0.1, 0.2], [0.0, 1.0, 2.0], wrap(values), unit='mm')


@pytest.mark.parametrize(
    'time', [np.arange(4) * 0.1, np.datetime64('2026-01-01', 'ms') + 100 * np.arange(4)]
)
def test_masked_times_are_refused(time: np.ndarray) -> None:
    """Nobody knows when that sample was taken, whatever stands under the mask."""
    for masked in ([False, False, True, False], [False] * 4):
        hidden = np.ma.array(time, mask=masked)
        if any(masked):
            with pytest.raises(ag.InputError, match='time is masked at sample 2'):
                ag.Record.from_arrays(hidden, [0, 1, 2, 3], [0, 1, 2, 3], unit='mm')
        else:
            made = ag.Record.from_arrays(hidden, [0, 1, 2, 3], [0, 1, 2, 3], unit='mm')
            assert made.period == pytest.approx(0.1)


def test_times_of_day_are_seconds_of_it() -> None:
    """As a spreadsheet holds them; three that are one are refused like any other times."""
    times = [
        (pd.Timestamp('2026-01-01 10:00') + pd.Timedelta(seconds=i / 8)).time() for i in range(5)
    ]
    made = ag.Record.from_arrays(times, range(5), range(5), unit='mm')
    assert made.period == 0.125 and made.start_ns == 36_000 * 10**9
    with pytest.raises(ag.InputError, match='stands still'):
        ag.Record.from_arrays(times[:1] * 3, [0, 1, 2], [0, 1, 2], unit='mm')
    with pytest.raises(ag.InputError, match='no list of seconds or of datetimes'):
        ag.Record.from_arrays([times[0], pd.Timestamp('2026-01-01')], [0, 1], [0, 1], unit='mm')
