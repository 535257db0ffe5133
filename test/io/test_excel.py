"""Workbooks: dates, times of day and durations as times; cells that are no number."""

import datetime
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from actuator_glue.errors import InputError
from actuator_glue.io.laboratory import read
from actuator_glue.io.look import look

COUNT = 500
SECONDS = np.arange(COUNT) * 0.01
COMMAND = np.sin(3 * SECONDS**2)
MEASURED = np.roll(COMMAND, 3)


def workbook(path: Path, times: list, head: str = 'Time', odd: object = None) -> Path:
    """Write times, command and measured; `odd` in place of the 41st command."""
    book = openpyxl.Workbook()
    book.active.append(['A title', datetime.datetime(2024, 5, 3)])
    book.active.append([head, 'command_mm', 'measured_mm'])
    for i, time in enumerate(times):
        command = odd if odd is not None and i == 40 else float(COMMAND[i])
        book.active.append([time, command, float(MEASURED[i])])
    book.save(path)
    return path


@pytest.mark.parametrize('head', ['Time', 'time_ms', 'Time [h]'])
@pytest.mark.parametrize(
    ('made', 'start'),
    [
        (lambda s: datetime.datetime(2024, 5, 3, 9, 59, 58) + s, 1_714_730_398),
        (lambda s: (datetime.datetime(2024, 5, 3, 9, 59, 58) + s).time(), 35_998),
        (lambda s: s, 0),
    ],
    ids=['date', 'time of day', 'duration'],
)
def test_times_are_what_their_cells_are(tmp_path: Path, made, start: int, head: str) -> None:
    """A date, a time of day or a duration is read in seconds, whatever its name says."""
    times = [made(datetime.timedelta(seconds=s)) for s in SECONDS.tolist()]
    path = workbook(tmp_path / 'a.xlsx', times, head)
    record = read(path)
    np.testing.assert_allclose(record.command, COMMAND * 1e-3, rtol=1e-12)
    assert record.period == 0.01
    assert record.start_ns == pytest.approx(start * 10**9, abs=1e6)
    assert look(path).columns[0].unit == 's'


def test_times_of_day_over_midnight_are_refused(tmp_path: Path) -> None:
    """They go back there: nothing says which day it is."""
    start = datetime.datetime(2024, 5, 3, 23, 59, 58)
    times = [(start + datetime.timedelta(seconds=s)).time() for s in SECONDS.tolist()]
    with pytest.raises(
        InputError, match=r'time goes back at sample 200 .*pass midnight there: give the dates'
    ):
        read(workbook(tmp_path / 'a.xlsx', times))


@pytest.mark.parametrize('odd', ['#N/A', '1,5', True, datetime.time(1, 2)])
def test_a_cell_that_is_no_number_is_told_with_its_row(tmp_path: Path, odd: object) -> None:
    """An error of a formula, a number that is text, a truth, a time among lengths."""
    path = workbook(tmp_path / 'a.xlsx', SECONDS.tolist(), 'time_s', odd)
    with pytest.raises(InputError, match=r"command .* first in row 43 of column 'command_mm'"):
        read(path)
