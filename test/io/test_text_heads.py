"""Lines about the names of columns, and the end of a text: nothing is taken for something else."""

from pathlib import Path

import numpy as np
import pytest

from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.laboratory import read

_COUNT = 400
_TIME = np.arange(_COUNT) / 500.0
_COMMAND = np.round(7.0 * np.sin(20.0 * _TIME), 4)
_MEASURED = np.round(6.9 * np.sin(20.0 * (_TIME - 0.015)), 4)
_FORCE = np.round(250.0 * np.sin(20.0 * (_TIME - 0.015)), 4)
_COLUMNS = (_TIME, _COMMAND, _MEASURED, _FORCE)
_NAMES = 'time_s,command_mm,measured_mm,force_N'
_BARE, _UNITS = 'time,command,measured,force', 's,mm,mm,N'
_BROKEN = 'time_s,"command\n[mm]","measured\n[mm]","force\n[N]"'


def _write(path: Path, head: str, end: str = '\n', form: str = '{:.4f}') -> Path:
    rows = [','.join(map(form.format, row)) for row in zip(*_COLUMNS, strict=True)]
    path.write_text('\n'.join([*([head] if head else []), *rows]) + end, encoding='utf-8')
    return path


def _check(path: Path, **options) -> None:
    record = read(path, **options)
    np.testing.assert_allclose(record.command, 1e-3 * _COMMAND, atol=1e-9)
    np.testing.assert_allclose(record.measured, 1e-3 * _MEASURED, atol=1e-9)
    np.testing.assert_allclose(record.force, _FORCE, atol=1e-9)
    assert record.rate == 500.0


@pytest.mark.parametrize(
    'head',
    [
        f'\n{_NAMES}',
        f'# a test\n\n{_NAMES}',
        f'{_NAMES}\n# marker: none',
        f'{_NAMES}\n\n# 400 samples\n',
        f'{_BARE}\n\n{_UNITS}',
        f'{_BARE}\n# as saved\n{_UNITS}\n',
        _BROKEN,
        f'# a test\n{_BROKEN}\n',
    ],
)
def test_lines_about_the_names_are_stepped_over(head: str, tmp_path: Path) -> None:
    _check(_write(tmp_path / 'a.csv', head))


@pytest.mark.parametrize(
    'head',
    [
        'Time [s] Command [mm] Measured [mm] Force [N]',
        '  Time (s)   Command (mm)   Measured (mm)   Force (N)',
        '# Time (s) Command (mm)   Measured (mm) Force (N)',
        '  Time  Command   Measured   Force  \n   s  mm  mm  N',
    ],
)
def test_names_between_blanks_may_have_some(head: str, tmp_path: Path) -> None:
    """`[s]` is no column of its own."""
    path = _write(tmp_path / 'a.txt', head)
    path.write_text(path.read_text().replace(',', ' '))
    _check(path)


def test_names_of_several_words_stand_apart_by_more_blanks(tmp_path: Path) -> None:
    head = 'Running Time   Axial Command   Axial Disp   Axial Load\n sec  mm  mm  N'
    path, out = _write(tmp_path / 'a.txt', head), tmp_path / 'map.yaml'
    path.write_text(path.read_text().replace(',', '  '))
    assert main(['map', str(path), '--out', str(out)]) == 0
    assert 'CHECK unit' not in out.read_text()
    _check(path, channels=out)


def test_kinds_of_samples_below_the_units_are_stepped_over(tmp_path: Path) -> None:
    """As data loggers write them."""
    _check(_write(tmp_path / 'a.csv', f'{_BARE}\n{_UNITS}\nSmp,Smp,Smp,Smp'))
    _check(_write(tmp_path / 'b.csv', f'{_BARE}\n{_UNITS}\n"","Smp","Smp","Smp"'))


@pytest.mark.parametrize('row', ['0.0000,NA,NA,NA', 'NaN,NaN,NaN,NaN', 'Smp,A,B,C'])
def test_what_may_be_a_sample_is_not_stepped_over(row: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r'no number, in .* line 3'):
        read(_write(tmp_path / 'a.csv', f'{_BARE}\n{_UNITS}\n{row}'))


def test_exponents_of_fortran_are_numbers(tmp_path: Path) -> None:
    path, out = _write(tmp_path / 'a.csv', _NAMES, form='{:.8E}'), tmp_path / 'map.yaml'
    names, rows = path.read_text().split('\n', 1)
    path.write_text(f'{names}\n{rows.replace("E", "D")}')
    _check(path)
    assert main(['map', str(path), '--out', str(out)]) == 0
    _check(path, channels=out)


def test_a_note_below_the_names_counts(tmp_path: Path) -> None:
    path = _write(tmp_path / 'a.csv', f'{_NAMES}\n# stiffness_N_per_m = 250e3')
    assert read(path).stiffness == 250e3
    path = _write(tmp_path / 'b.csv', f'{_NAMES}\n# stiffness = 250e3')
    with pytest.raises(InputError, match='is not understood'):
        read(path)


def test_a_sign_of_inches_opens_no_quote(tmp_path: Path) -> None:
    _check(_write(tmp_path / 'a.csv', f'{_NAMES},remark 5"'))


def test_signs_of_inches_in_rows_or_a_title_end_no_name(tmp_path: Path) -> None:
    path = _write(tmp_path / 'a.csv', f'{_NAMES},size 5"')
    names, *rows = path.read_text().splitlines()
    path.write_text('\n'.join([names, *(f'{row},3"' for row in rows)]))
    _check(path)
    path = _write(
        tmp_path / 'b.txt', 'Rod of 5" length\nTime [s],Command [mm],Stroke of 5" [mm],Load [N]'
    )
    assert main(['map', str(path), '--out', str(tmp_path / 'map.yaml')]) == 0
    _check(path, channels=tmp_path / 'map.yaml')


def test_numbers_of_samples_are_no_comments(tmp_path: Path) -> None:
    path = _write(tmp_path / 'a.csv', f'id,{_NAMES}')
    names, *rows = path.read_text().splitlines()
    path.write_text('\n'.join([names, *(f'#{i},{row}' for i, row in enumerate(rows))]))
    _check(path)


@pytest.mark.parametrize(
    'head',
    [
        'Channels: 4\nlength;x\nTime [s],Command [mm],Position [mm],Load [N]\n',
        'Logger 3\nTime,Command,Position,Load\n[s],[mm],[mm],[N]\n\n',
        '"TOA5","CR6"\nTime,Command,Position,Load\n"s","mm","mm","N"\n"","Smp","Smp","Smp"',
        f'T0=12.03.2024\n\nTime,Command,Position,Load\ns,mm,mm,N\n{",".join(["SR=500 Hz"] * 4)}',
        'Logger 3\nTime,Command,Position,Load\n\n[s],[mm],[mm],[N]\n',
        'Logger 3\nTime [s],"Command\n[mm]","Position\n[mm]","Load\n[N]"',
    ],
)
def test_a_map_finds_the_names_above_empty_lines(head: str, tmp_path: Path) -> None:
    path, out = _write(tmp_path / 'a.txt', head), tmp_path / 'map.yaml'
    assert main(['map', str(path), '--out', str(out)]) == 0
    assert 'CHECK unit' not in out.read_text()
    _check(path, channels=out)


@pytest.mark.parametrize('digits', [1, 3, 4, 5])
@pytest.mark.parametrize('form', ['{:.4f}', '{:.9e}'])
def test_a_text_that_ends_within_a_number_is_refused(
    form: str, digits: int, tmp_path: Path
) -> None:
    path = _write(tmp_path / 'a.csv', _NAMES, '', form)
    path.write_text(path.read_text()[:-digits])
    with pytest.raises(InputError, match=f'cut off within its last number.*line {_COUNT + 1} '):
        read(path)


@pytest.mark.parametrize('form', ['{:.4f}', '{:.9e}', '{:.7g}', '{}'])
def test_a_text_may_end_without_a_line_end(form: str, tmp_path: Path) -> None:
    _check(_write(tmp_path / 'a.csv', _NAMES, '', form))


@pytest.mark.parametrize(
    ('usual', 'last'),
    [
        ('0.25', '0.3'),
        ('1.5', '2'),
        ('1.5e-10', '1e-10'),
        ('0.50', 'nan'),
        ('0.50', ''),
        ('0.50', 'NA'),
        ('v1.10', 'v2'),
    ],
)
def test_what_ends_shorter_may_be_whole(usual: str, last: str, tmp_path: Path) -> None:
    """At rest all numbers are alike; a gap or a remark is no number that was cut off."""
    path = _write(tmp_path / 'a.csv', f'{_NAMES},state')
    names, *rows = path.read_text().splitlines()
    path.write_text(
        '\n'.join([names, *(f'{row},{usual}' for row in rows[:-1]), f'{rows[-1]},{last}'])
    )
    _check(path)


def test_a_time_of_a_whole_second_is_whole(tmp_path: Path) -> None:
    rows = [f'{i / 500.0},1.0,0.5,08:00:00.{2000 * i:06d}' for i in range(_COUNT)]
    path = tmp_path / 'a.csv'
    path.write_text(
        '\n'.join(['time_s,command_mm,measured_mm,stamp', *rows, '0.8,1.0,0.5,08:00:01'])
    )
    assert len(read(path).command) == _COUNT + 1
