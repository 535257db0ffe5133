"""Workbooks: dates, times of day and durations as times; cells that are no number."""

import datetime
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from actuator_glue.cli.main import main
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


def _sheets(path: Path, sheets: dict[str, list[list[object]]]) -> Path:
    """Write rows by the title of their sheet."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, rows in sheets.items():
        sheet = book.create_sheet(title)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


_ROWS = np.column_stack([SECONDS, COMMAND, MEASURED]).tolist()
_RUN = [['time_s', 'command_mm', 'measured_mm'], *_ROWS]
_MAPPED = (('time', 1, 's'), ('command', 2, 'mm'), ('measured', 3, 'mm'))
_SUMMARY = [['Rate', 'Load'], [100, 2], [200, 5]]


def test_the_sheet_with_the_channels_is_read(tmp_path: Path) -> None:
    path = _sheets(tmp_path / 'a.xlsx', {'summary': _SUMMARY, 'run': _RUN})
    told: list[str] = []
    np.testing.assert_allclose(read(path, warn=told.append).command, COMMAND * 1e-3)
    assert not told
    mapped = tmp_path / 'map.yaml'
    mapped.write_text(
        'time: {column: time_s, unit: s}\ncommand: {column: command_mm, unit: mm}\n'
        'measured: {column: 3, unit: mm}\n'
    )
    np.testing.assert_allclose(read(path, channels=mapped).command, COMMAND * 1e-3)


def test_of_several_sheets_with_a_record_it_is_told_which_is_read(tmp_path: Path, capsys) -> None:
    second = [_RUN[0], *[[t, 2.0 * c, m] for t, c, m in _ROWS]]
    path = _sheets(tmp_path / 'a.xlsx', {'run 1': _RUN, 'run 2': second, 'end': _SUMMARY})
    told: list[str] = []
    np.testing.assert_allclose(read(path, warn=told.append).command, COMMAND * 1e-3)
    (line,) = told
    assert line.startswith(f"{path}: sheet 'run 1' is read, and 'run 2' could be as well")
    assert main(['map', str(path)]) == 0
    assert capsys.readouterr().err.count('could be as well') == 1


@pytest.mark.parametrize('first', [False, True])
def test_a_sheet_of_peaks_or_settings_is_no_record(tmp_path: Path, first: bool) -> None:
    """Neither read in place of one nor told, whatever it shares with it."""
    peaks = [['cycle', 'command_mm', 'measured_mm'], *[[i, 7.0, 6.5 + i] for i in range(9)]]
    path = _sheets(
        tmp_path / 'a.xlsx',
        {'peaks': peaks, 'run': _RUN} if first else {'run': _RUN, 'peaks': peaks},
    )
    told: list[str] = []
    np.testing.assert_allclose(read(path, warn=told.append).command, COMMAND * 1e-3)
    gains = [['gain', 'value', 'least', 'most'], *[[i, 1.0, 0.0, 2.0] for i in range(9)]]
    path = _sheets(tmp_path / 'a.xlsx', {'run': _RUN, 'gains': gains})
    mapped = tmp_path / 'map.yaml'
    mapped.write_text('\n'.join(f'{r}: {{column: {i}, unit: {u}}}' for r, i, u in _MAPPED))
    np.testing.assert_allclose(
        read(path, channels=mapped, warn=told.append).command, COMMAND * 1e-3
    )
    assert not told


def test_a_name_merged_over_two_rows_is_a_name(tmp_path: Path) -> None:
    head = [['time_s', 'Displacement', None], [None, 'command_mm', 'measured_mm']]
    path = _sheets(tmp_path / 'a.xlsx', {'run': [*head, *_ROWS]})
    assert read(path).rate == 100.0


def test_a_title_names_no_column(tmp_path: Path) -> None:
    rows = [[None, *_RUN[0]], *[[i, *row] for i, row in enumerate(_ROWS)]]
    assert read(_sheets(tmp_path / 'a.xlsx', {'run': [['Force test'], *rows]})).force is None


def test_numbers_as_text_are_told(tmp_path: Path) -> None:
    rows = [[f'{v:.5f}' for v in row] for row in _ROWS]
    with pytest.raises(InputError, match='numbers that are kept as text are none'):
        read(_sheets(tmp_path / 'a.xlsx', {'run': [_RUN[0], *rows]}))


@pytest.mark.parametrize('above', [['Rate', 100], ['Test 12 of 3 May']])
def test_a_setting_names_no_column(tmp_path: Path, above: list[object]) -> None:
    """The columns have numbers then, as those of texts; a map had `column: "100"`."""
    path, out = _sheets(tmp_path / 'a.xlsx', {'run': [above, *_ROWS]}), tmp_path / 'map.yaml'
    with pytest.raises(InputError, match='the columns are 1, 2, 3'):
        read(path)
    mapped = [f'{r}: {{column: {i}, unit: {u}}}' for r, i, u in _MAPPED]
    out.write_text('\n'.join(mapped))
    np.testing.assert_allclose(read(path, channels=out).command, COMMAND * 1e-3)


@pytest.mark.parametrize('at', [0, 1, 2, 3])
def test_one_column_may_be_named_below_what_it_is_of(tmp_path: Path, at: int) -> None:
    """A lone cell below names is no title, and columns behind it keep their names."""
    upper, lower = [*_RUN[0], 'force_kN'], [None] * 4
    upper[at], lower[at] = 'Specimen', upper[at]
    rows = [[*row, t] for row, t in zip(_ROWS, SECONDS, strict=True)]
    record = read(_sheets(tmp_path / 'a.xlsx', {'run': [upper, lower, *rows]}))
    np.testing.assert_allclose(record.command, COMMAND * 1e-3)
    np.testing.assert_allclose(record.force, SECONDS * 1e3)


def test_settings_above_the_names_are_stepped_over(tmp_path: Path) -> None:
    """A row of numbers is no sample where there are names below it."""
    head = [['Rate', 100], [1, 2, 3], _RUN[0]]
    path = _sheets(tmp_path / 'a.xlsx', {'run': [*head, *_ROWS]})
    np.testing.assert_allclose(read(path).command, COMMAND * 1e-3)


def test_a_number_may_be_a_name(tmp_path: Path) -> None:
    """Where each column has one."""
    rows = [[*_RUN[0], 2024], *[[*row, 1.0] for row in _ROWS]]
    np.testing.assert_allclose(
        read(_sheets(tmp_path / 'a.xlsx', {'run': rows})).command, COMMAND * 1e-3
    )


@pytest.mark.parametrize(
    'head',
    [
        [['hold', 'linear'], ['Stiffness_N_per_m', 250e3], ['stiffness', 'of steel']],
        [['# hold = linear'], ['# stiffness_N_per_m = 250e3'], ['Hold the piston = yes']],
        [['hold', 'linear'], ['Stiffness_N_per_m', 250e3], ['Hold', '5 s'], ['# hold: 5 s']],
    ],
)
def test_notes_above_the_names_count(tmp_path: Path, head: list[list[object]]) -> None:
    """They were passed over without a word; other settings stay the laboratory's own."""
    record = read(_sheets(tmp_path / 'a.xlsx', {'run': [*head, _RUN[0], *_ROWS]}))
    assert (record.hold, record.stiffness) == ('linear', 250e3)
