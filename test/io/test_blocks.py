"""Text files of test machines: blocks of samples with heads of their own, and what follows."""

from pathlib import Path

import numpy as np
import pytest

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.errors import InputError

COUNT, PERIOD = 1500, 2e-3
TIME = np.arange(COUNT) * PERIOD
RNG = np.random.default_rng(4)
COMMAND = np.interp(TIME, np.arange(0.0, 3.2, 0.1), 5.0 * RNG.standard_normal(32))  # mm
MEASURED = np.interp(TIME - 0.02, TIME, COMMAND)
FORCE = 3.0 * MEASURED
TABLE = np.column_stack([TIME, COMMAND, MEASURED, FORCE])
NAMES = ('Time', 'Ch 1 Command', 'Ch 1 Displacement', 'Ch 1 Force')
UNITS = ('Sec', 'mm', 'mm', 'kN')


def rows(part: np.ndarray, by: str, quote: str = '') -> list[str]:
    """Return rows of text."""
    return [by.join(f'{quote}{v:.7f}{quote}' for v in row) for row in part]


def mts(*ends: int, by: str = '\t') -> str:
    """Return a file of MTS MPT: a line of its own above each block, names, units, a blank line."""
    lines = ['MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A', '']
    first = 0
    for end in ends:
        stamp = f'Data Acquisition: Timed{by}{by}{by}Time:{by}{TIME[first]:.4f}{by}Sec'
        lines += [stamp, by.join(NAMES), by.join(UNITS), *rows(TABLE[first:end], by), '']
        first = end
    return '\r\n'.join(lines)


def instron(after: str = '') -> str:
    """Return a file of Instron Bluehill: everything in quotes, units in brackets."""
    names = ['"Time","Position Command","Position","Load"', '"(s)","(mm)","(mm)","(kN)"']
    lines = ['"Specimen label","1"', '"Test date","2024-05-03"', '', *names]
    return '\r\n'.join([*lines, *rows(TABLE, ',', '"'), after])


def wavematrix() -> str:
    """Return a file of Instron WaveMatrix: long names with commas inside, counters between."""
    head = '"Total Time (s)","Total Cycles","Position(8800 (0,1):Command) (mm)",'
    head += '"Position(8800 (0,1):Position) (mm)","Load(8800 (0,2):Load) (kN)"'
    table = [f'{t:.7f},0,{u:.7f},{x:.7f},{f:.7f}' for t, u, x, f in TABLE]
    return '\r\n'.join([head, *table, ''])


def test_suite() -> str:
    """Return a file of MTS TestSuite: date and station above, times in the last column."""
    lines = ['"Date:","5/3/2024 10:01:02 AM"', '"Station","one"', '']
    lines += ['"Axial Count","Axial Command","Axial Displacement","Axial Force","Running Time"']
    lines += ['"segments","mm","mm","kN","sec"']
    return '\r\n'.join([*lines, *(f'1,{u:.7f},{x:.7f},{f:.7f},{t:.7f}' for t, u, x, f in TABLE)])


FILES = {
    'mts of one block': (mts(COUNT), slice(0, COUNT)),
    'mts of three blocks': (mts(100, 1300, COUNT), slice(100, 1300)),
    'mts, the last one longest': (mts(300, COUNT), slice(300, COUNT)),
    'mts with commas': (mts(100, 1300, COUNT, by=','), slice(100, 1300)),
    'bluehill': (instron(), slice(0, COUNT)),
    'bluehill with results below': (instron('"Maximum load","12.3"'), slice(0, COUNT)),
    'wavematrix': (wavematrix(), slice(0, COUNT)),
    'testsuite': (test_suite(), slice(0, COUNT)),
}
del test_suite  # it writes a file, it is no test


@pytest.mark.parametrize('kind', FILES)
def test_map_reads_the_longest_block(tmp_path: Path, kind: str) -> None:
    """Names, units, times and force as the machine writes them."""
    text, part = FILES[kind]
    path, out = tmp_path / 'a.txt', tmp_path / 'map.yaml'
    path.write_bytes(text.encode())
    assert main(['map', str(path), '--out', str(out)]) == 0
    record = ag.load(path, channels=out)
    np.testing.assert_allclose(record.command, 1e-3 * COMMAND[part], atol=1e-10)
    np.testing.assert_allclose(record.measured, 1e-3 * MEASURED[part], atol=1e-10)
    np.testing.assert_allclose(record.force, 1e3 * FORCE[part], atol=1e-3)
    assert record.period == PERIOD


def test_the_other_blocks_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where they begin and how long they are; without a map the file is not read half."""
    path = tmp_path / 'a.txt'
    path.write_bytes(mts(100, 1300, COUNT).encode())
    assert main(['map', str(path)]) == 0
    said = capsys.readouterr().out
    assert 'rows: 1200\n' in said
    assert 'CHECK block: the longest of 3' in said
    assert '100 below line 4, 1200 below line 108, 200 below line 1312' in said
    table = '\n'.join(['time_s,command_mm,measured_mm', *rows(TABLE[:50, :3], ',')])
    path.write_text(f'{table}\n\nsecond part\n{table}\n')
    with pytest.raises(InputError, match=r'line 53 has 1 entries.*`actuator-glue map` proposes'):
        ag.load(path)


def test_rows_that_are_not_there_are_missed(tmp_path: Path) -> None:
    """A file that is shorter than its map says is cut off."""
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join(['t,u,x', *rows(TABLE[:50, :3], ',')]))
    text = 'header_lines: 1\nrows: {}\nrate: 500\n'
    text += 'command: {{column: u, unit: mm}}\nmeasured: {{column: x, unit: mm}}\n'
    (tmp_path / 'map.yaml').write_text(text.format(20))
    assert len(ag.load(path, channels=tmp_path / 'map.yaml')) == 20
    (tmp_path / 'map.yaml').write_text(text.format(60))
    with pytest.raises(InputError, match=r'50 samples after the 1 header lines.*rows: 60'):
        ag.load(path, channels=tmp_path / 'map.yaml')


ENDS = '\n', '\r\n', '\r\r\n', '\r'
BLANKS = (), (0,), (1,), (3,), (2, 2), (3, 4)


@pytest.mark.parametrize(
    ('end', 'blank', 'by'),
    [  # each line end with each place of blanks; each of both with each separator
        (end, blank, ',;\t'[(i + j) % 3])
        for i, end in enumerate(ENDS)
        for j, blank in enumerate(BLANKS)
    ],
)
def test_line_ends_and_blank_columns(tmp_path: Path, end: str, blank: tuple, by: str) -> None:
    """Columns without a name or a number anywhere, with every line end there is."""
    lines = []
    for row in [['time [s]', 'command [mm]', 'measured [mm]'], *TABLE[:60, :3].tolist()]:
        entries = [str(entry) for entry in row]
        for at in blank:
            entries.insert(at, '')
        lines.append(by.join(entries))
    path, out = tmp_path / 'a.txt', tmp_path / 'map.yaml'
    path.write_bytes((end.join(lines) + end).encode())
    assert main(['map', str(path), '--out', str(out)]) == 0
    for record in (ag.load(path), ag.load(path, channels=out)):
        np.testing.assert_allclose(record.measured, 1e-3 * MEASURED[:60], atol=1e-15)
        assert record.period == PERIOD
