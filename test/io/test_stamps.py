"""Dates and times of day as the clock of a text."""

import datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.formats.delimited import seconds_of
from actuator_glue.io.laboratory import read
from actuator_glue.io.look import look

COUNT = 400
COMMAND = np.sin(1e-3 * np.arange(COUNT) ** 2)
START = datetime.datetime(2024, 5, 3, 9, 59, 58, tzinfo=datetime.UTC)
DAY = 1_714_694_400  # 2024-05-03 [s]


def table(path: Path, form: str, start: datetime.datetime = START, by: str = ',') -> Path:
    """Write stamps of 5 ms, their thousandths as `form` has them, command and measured."""
    lines = [by.join(['Timestamp', 'command_mm', 'measured_mm'])]
    for i in range(COUNT):
        stamp = start + datetime.timedelta(milliseconds=5 * i)
        text = stamp.strftime(form).replace('MS', f'{stamp.microsecond // 1000:03d}')
        lines.append(by.join([text, f'{COMMAND[i]:.6f}', f'{COMMAND[i - 3]:.6f}']))
    path.write_text('\n'.join(lines) + '\n')
    return path


@pytest.mark.parametrize(
    ('form', 'by', 'start'),
    [
        ('%Y-%m-%dT%H:%M:%S.MS', ',', DAY + 35_998),
        ('%Y-%m-%d %H:%M:%S.MS', ',', DAY + 35_998),
        ('%Y/%m/%d %H:%M:%S.MS', '\t', DAY + 35_998),
        ('%Y-%m-%d %H:%M:%S,MS', ';', DAY + 35_998),
        ('%Y-%m-%dT%H:%M:%S.MSZ', ',', DAY + 35_998),
        ('%Y-%m-%dT%H:%M:%S.MS+02:00', ',', DAY + 28_798),
        ('"%Y-%m-%d %H:%M:%S.MS"', ' ', DAY + 35_998),
        ('%d.%m.%Y %H:%M:%S,MS', ';', DAY + 35_998),
        ('%d-%b-%Y %H:%M:%S.MS', '\t', DAY + 35_998),
        ('%d %b %Y %I:%M:%S.MS %p', ',', DAY + 35_998),
        ('%I:%M:%S.MS %p', ';', 35_998),
        ('%H:%M:%S.MS', ' ', 35_998),
        ('%H:%M:%S,MS000', ';', 35_998),
        ('%Y.%m.%d %H:%M:%S.MS', ',', DAY + 35_998),
        ('%Y-%m-%d %H:%M:%S:MS', ',', DAY + 35_998),
        ('%H:%M:%S:MS', '\t', 35_998),
    ],
)
def test_stamps_are_times(tmp_path: Path, form: str, by: str, start: int) -> None:
    """ISO 8601 with or without a zone, slashes, a decimal comma; times of day; also by `map`."""
    path = table(tmp_path / 'a.csv', form, by=by)
    record = read(path)
    assert record.period == 5e-3
    assert record.start_ns == pytest.approx(start * 10**9, abs=1000)
    np.testing.assert_allclose(record.command, np.round(COMMAND, 6) * 1e-3, atol=1e-12)
    assert look(path).columns[0].unit == 's'
    assert main(['map', str(path)]) == 0


def test_a_stamp_that_is_none_is_told_with_its_line(tmp_path: Path) -> None:
    """Hours that no day has, a number among stamps; a day that ends is a time that goes back."""
    path = table(tmp_path / 'a.csv', '%H:%M:%S.MS')
    for odd in ('25:61:00.000', '36000.5', ''):
        path.write_text(path.read_text().replace('09:59:58.750', odd))
        with pytest.raises(InputError, match=f"time is NaN.*line 152: '{odd}'"):
            read(path)
        table(tmp_path / 'a.csv', '%H:%M:%S.MS')
    night = START.replace(hour=23, minute=59, second=59)
    with pytest.raises(InputError, match='time goes back at sample 200'):
        read(table(tmp_path / 'a.csv', '%H:%M:%S.MS', night))


@pytest.mark.parametrize(
    'form',
    [
        '%m/%d/%Y %H:%M:%S.MS',
        '%d/%m/%Y %I:%M:%S.MS %p',
        '%d.%m.%y %H:%M:%S.MS',
        '%m-%d-%Y %H:%M:%S.MS',
    ],
)
def test_of_dates_whose_order_is_open_the_time_of_day_is_taken(tmp_path: Path, form: str) -> None:
    """05/03 is March or May, which no step between samples minds; `map` asks for no rate."""
    path = table(tmp_path / 'a.csv', form)
    record = read(path)
    assert (record.period, record.start_ns) == (5e-3, pytest.approx(35_998 * 10**9, abs=1000))
    noon = START.replace(hour=12, minute=30)
    at_noon = read(table(path, form, noon)).start_ns
    assert at_noon == pytest.approx(45_058 * 10**9, abs=1000)
    assert look(path).columns[0].unit == 's'
    midnight = START.replace(hour=23, minute=59, second=59)
    with pytest.raises(InputError, match='time goes back at sample 200'):
        read(table(path, form, midnight))


@pytest.mark.parametrize('odd', ['13:00:00.000 PM', '0:00:00 AM', '31.02.2024 10:00:00', 'noon'])
def test_what_no_clock_shows_is_no_time(tmp_path: Path, odd: str) -> None:
    """Hours beyond twelve in halves of a day, a day that no month has."""
    path = table(tmp_path / 'a.csv', '%d.%m.%Y %H:%M:%S.MS')
    path.write_text(path.read_text().replace('03.05.2024 09:59:58.750', odd))
    with pytest.raises(InputError, match='time is NaN'):
        read(path)


@pytest.mark.parametrize('form', ['%Y%m%dT%H%M%S.MS', '%M:%S.MS'])
def test_times_that_nobody_understands_are_told_as_such(tmp_path: Path, form: str) -> None:
    """All of them: no row to cut or repair."""
    path = table(tmp_path / 'a.csv', form)
    path.write_text(path.read_text().replace('Timestamp', 'time_s'))
    with pytest.raises(InputError, match='time is not understood in any sample, first in line 2'):
        read(path)


@pytest.mark.parametrize(
    ('begins', 'full', 'told'),
    [
        (3599.0, 3600.0, 'clocks are put back an hour there'),
        (59.0, 60.0, 'full after 60 s'),
        (65.0, 65.536, 'full after 65.536 s'),
        (4294.0, 4294.967296, r'full after 4294.967\d* s'),
        (7.0, 7.7, 'sort the record'),
    ],
)
def test_how_far_times_go_back_tells_why(
    tmp_path: Path, begins: float, full: float, told: str
) -> None:
    """A counter that is full, an hour of summer time, or nothing known."""
    rows = [f'{(begins + 1e-3 * i) % full:.6f},{i % 7},{i % 5}' for i in range(2000)]
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join(['time_s,command_mm,measured_mm', *rows]) + '\n')
    with pytest.raises(InputError, match=f'time goes back at sample .*{told}'):
        read(path)


@pytest.mark.parametrize('name', [None, 'time', 'Timestamp'])
@pytest.mark.parametrize('days', [None, 0, 400])
def test_an_index_of_times_as_pandas_writes_it(
    tmp_path: Path, name: str | None, days: int | None
) -> None:
    """Without a name in front of the others, and durations with days: both were refused."""
    first = 3600 + 86_400 * (days or 0)
    passed = pd.to_timedelta(5 * np.arange(COUNT) + 1000 * first, unit='ms')
    index = passed if days is not None else pd.Timestamp('2024-05-03') + passed
    frame = pd.DataFrame({'command_mm': COMMAND, 'measured_mm': np.roll(COMMAND, 3)}, index)
    frame.rename_axis(name).to_csv(tmp_path / 'a.csv')
    record = read(tmp_path / 'a.csv')
    start = first + (DAY if days is None else 0)
    assert (record.period, record.start_ns) == (5e-3, start * 10**9)


@pytest.mark.parametrize(
    'written',
    [
        '2026-{2:02d}-{3:02d} {0:02d}:{1:02d}:{1:02d}.{4:06d}',
        '2026-{2:02d}-{3:02d}T{0:02d}:{1:02d}:{1:02d}',
        '{0:02d}:{1:02d}:{1:02d}.{4:09d}',
        '{0:d}:{1:02d}:{1:02d}',
        '{3:02d}.{2:02d}.2026 {0:02d}:{1:02d}:{1:02d},{4:06d}',
    ],
)
def test_stamps_read_at_once_are_the_same_to_the_bit(written: str) -> None:
    """Impossible ones among them, which are no times: hour 24, second 60."""
    rng = np.random.default_rng(4)
    tops = (25, 61, 13, 29, 1_000_000)
    drawn = np.column_stack([rng.integers(k in (2, 3), top, 500) for k, top in enumerate(tops)])
    entries = [written.format(*row) for row in drawn.tolist()]
    possible = [e for e, row in zip(entries, drawn, strict=True) if row[0] < 24 and row[1] < 60]
    for some in (entries, possible):
        one_by_one = seconds_of([*some, '1:00:00 pm'])[:-1]  # not written as the others are
        np.testing.assert_array_equal(seconds_of(some), one_by_one)
    assert np.isfinite(seconds_of(possible)).all()
