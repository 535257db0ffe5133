"""Delimited text: no column is ever shifted, no number ever another one than was written."""

import os
from collections.abc import Callable
from pathlib import Path
from time import process_time

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import parse_channel_map, read_channel_map
from actuator_glue.io.laboratory import read
from actuator_glue.io.load import load_records
from actuator_glue.io.look import look

COUNT = 60
TIME = np.arange(COUNT) * 1e-3
COMMAND = np.round(7 * np.sin(90 * TIME), 4)  # mm
MEASURED = np.round(6 * np.sin(90 * TIME - 0.5), 4)  # mm
FORCE = np.round(2461.3 * np.cos(90 * TIME))  # N
NAMES = ('time_s', 'command_mm', 'measured_mm', 'force_N')
COLUMNS = (TIME, COMMAND, MEASURED, FORCE)
ROWS = [
    [f'{t:.3f}', f'{c:.4f}', f'{m:.4f}', f'{f:.0f}'] for t, c, m, f in zip(*COLUMNS, strict=True)
]

# What pandas takes for missing (its documentation of `na_values`).
PANDAS = ['', '#N/A', '#N/A N/A', '#NA', '-1.#IND', '-1.#QNAN', '-NaN', '-nan', '1.#IND']
PANDAS += ['1.#QNAN', '<NA>', 'N/A', 'NA', 'NULL', 'NaN', 'None', 'n/a', 'nan', 'null']
MSVC = ['-1.#IND00', '1.#QNAN', '1.#QNAN0', '1.#SNAN', '1.#INF', '-1.#INF00', '1.#J', '1.#R']
OTHERS = ['nan(ind)', '-nan(ind)', 'nan(snan)', 'inf', '-Infinity', '#DIV/0!', '-', 'OL']


BRACKETED = (('Command', 'mm'), ('Position', 'mm'), ('Load', 'N'))


def table(
    path: Path, rows: list[list[str]], names: tuple[str, ...] = NAMES, by: str = ','
) -> Path:
    """Write names and rows with a delimiter, and no quotes."""
    path.write_text('\n'.join(by.join(row) for row in [list(names), *rows]) + '\n')
    return path


def check(path: Path, *, force: bool = True) -> None:
    """Compare a record with what was written."""
    record = read(path)
    np.testing.assert_allclose(record.command, COMMAND * 1e-3, atol=1e-12)
    np.testing.assert_allclose(record.measured, MEASURED * 1e-3, atol=1e-12)
    assert record.period == 1e-3
    if force:
        assert record.force is not None
        np.testing.assert_allclose(record.force, FORCE)


def shown(kind: str) -> str:
    """Return the channels as pandas prints them, all rows."""
    frame = pd.DataFrame(dict(zip(NAMES, COLUMNS, strict=True)))
    blanks = ['Time [s]', 'Command [mm]', 'Measured [mm]', 'Force [N]']
    frames = {
        'numbers in front': frame,
        'from another row on': frame.set_axis(range(1000, 1000 + COUNT)),
        'every other number': frame.set_axis(range(0, 2 * COUNT, 2)),
        'a name of the index': frame.rename_axis('row'),
        'times as index': frame.set_index('time_s'),
        'other names in front': frame[['command_mm', 'time_s', 'measured_mm', 'force_N']],
        'a column that counts': frame.assign(sample=range(COUNT))[['sample', *NAMES]],
        'blanks in names': frame.set_axis(blanks, axis='columns'),
        'a blank in one name': frame.assign(**{'P1 bar': FORCE}),
    }
    return frames[kind].to_string()


SHOWN = ['numbers in front', 'from another row on', 'every other number', 'a name of the index']
SHOWN += ['times as index', 'other names in front', 'a column that counts', 'blanks in names']
SHOWN += ['a blank in one name']


@pytest.mark.parametrize('end', ['', '\n', '\r\n'])
@pytest.mark.parametrize('kind', SHOWN)
def test_what_pandas_prints_is_read(tmp_path: Path, kind: str, end: str) -> None:
    """`DataFrame.to_string()`: names end above their numbers, the index has none."""
    text = shown(kind).replace('\n', end or '\n') + end
    (tmp_path / 'a.txt').write_bytes(text.encode())
    check(tmp_path / 'a.txt')


@pytest.mark.parametrize('index', ['time_s', 'Time [s]', 'no'])
def test_a_map_of_what_pandas_prints_has_its_names(tmp_path: Path, index: str) -> None:
    """The line with the name of the index was taken for that of all."""
    frame = pd.DataFrame(dict(zip(NAMES[1:], COLUMNS[1:], strict=True)))
    frame.set_axis(pd.Index(TIME, name=index)).to_string(tmp_path / 'a.txt')
    assert [column.name for column in look(tmp_path / 'a.txt').columns] == [index, *NAMES[1:]]


def test_numbers_that_do_not_stand_below_the_names_are_refused(tmp_path: Path) -> None:
    """One name less than numbers, and nothing tells which has none."""
    head, *rows = shown('numbers in front').splitlines()
    for wrong in (head.strip(), head[2:]):
        (tmp_path / 'a.txt').write_text('\n'.join([wrong, *rows]) + '\n')
        with pytest.raises(InputError, match='4 names, but 5 entries'):
            read(tmp_path / 'a.txt')
    (tmp_path / 'a.txt').write_text('\n'.join([head, *rows[:9], '..     ...', *rows[-9:]]) + '\n')
    with pytest.raises(InputError, match=r'line 11 is of dots: rows are left out'):
        read(tmp_path / 'a.txt')


@st.composite
def written(draw: st.DrawFn) -> tuple[str, str, str, list[str]]:
    """Return a text, its delimiter, its decimal sign and the names in its first line."""
    delimiter = draw(st.sampled_from([',', ';', '\t', ' ']))
    decimal = draw(st.sampled_from(['.', ',']))
    width = draw(st.integers(3, 5))
    digits = draw(st.integers(0, 4))
    numbered = draw(st.booleans())
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    rows = [
        [f'{i * 1e-3:.3f}', *(f'{v:.{digits}f}' for v in 30 * rng.standard_normal(width - 1))]
        for i in range(20)
    ]
    rows = [[v.replace('.', decimal) for v in row] for row in rows]
    names = ['time_s', 'command_mm', 'measured_mm', 'force_N', 'spare'][:width]
    if draw(st.booleans()):
        names[-1] = f'has{delimiter}it'
    missing = draw(st.sampled_from([*PANDAS, '-1.#IND00', 'OL', '1_0', '1e999']))
    if draw(st.integers(0, 3)) == 0:
        rows[draw(st.integers(0, 19))][draw(st.integers(0, width - 1))] = missing
    if numbered:
        rows = [[str(i), *row] for i, row in enumerate(rows, draw(st.integers(0, 1)))]
    change = draw(st.sampled_from(['none', 'none', 'less', 'more']))
    names = {'none': names, 'less': names[:-1], 'more': [*names, 'other']}[change]
    quotes = draw(st.sampled_from(['none', 'all', 'first', 'names']))

    def line(entries: list[str], first: bool) -> str:
        told = {'all': len(entries), 'first': 1, 'names': len(entries) * first, 'none': 0}[quotes]
        return delimiter.join(
            f'"{e}"' if i < told or delimiter in e else e for i, e in enumerate(entries)
        )

    lines = [line(names, True), *(line(row, False) for row in rows)]
    return '\n'.join(lines) + '\n', delimiter, decimal, names


@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(case=written(), by_map=st.booleans())
def test_text_is_read_as_pandas_does_or_refused(
    tmp_path: Path, case: tuple[str, str, str, list[str]], by_map: bool
) -> None:
    """Delimiter, quotes, decimal sign, a missing value, a running number, a name more or less."""
    text, delimiter, decimal, names = case
    path = tmp_path / 'a.txt'
    path.write_text(text, encoding='utf-8', newline='')
    described = parse_channel_map(
        {
            'time': {'column': 'time_s', 'unit': 's'},
            'command': {'column': 'command_mm', 'unit': 'mm'},
            'measured': {'column': names[min(2, len(names) - 1)], 'unit': 'mm'},
        },
        'map',
    )
    try:
        record = read(path, channels=described if by_map else None)
    except InputError:
        return
    frame = pd.read_csv(path, sep=delimiter, decimal=decimal)
    for role, column in (('command', 1), ('measured', min(2, len(names) - 1))):
        wanted = frame[names[column]].to_numpy(dtype=float) * 1e-3
        np.testing.assert_array_equal(getattr(record, role), wanted, err_msg=text)
    steps = np.diff(frame['time_s'].to_numpy(dtype=float))
    assert record.period == pytest.approx(steps.mean(), rel=1e-9)


@pytest.mark.parametrize('numbered', [False, True])
@pytest.mark.parametrize('quote', ['', '"'])
@pytest.mark.parametrize(
    ('by', 'decimal'),
    [(';', ','), (';', '.'), ('\t', ','), ('\t', '.'), (',', '.'), (' ', ','), (' ', '.')],
)
def test_every_usual_table_is_read(
    tmp_path: Path, by: str, decimal: str, quote: str, numbered: bool
) -> None:
    """Delimiters with either decimal sign, quotes about the names and the running numbers."""
    rows = [[v.replace('.', decimal) for v in row] for row in ROWS]
    if numbered:
        rows = [[f'"{i}"', *row] for i, row in enumerate(rows, 1)]
    names = tuple(f'{quote}{name}{quote}' for name in NAMES)
    check(table(tmp_path / 'a.txt', rows, names, by))


def test_one_name_fewer_is_no_guess(tmp_path: Path) -> None:
    """A last column without a name, numbers in front that a name may mean, two names fewer."""
    for names, rows in (
        (NAMES, [[*row, '7'] for row in ROWS]),
        (NAMES, [[str(i), *row] for i, row in enumerate(ROWS)]),
        (('sample', *NAMES), [['5', str(i), *row] for i, row in enumerate(ROWS)]),
        (NAMES, [[str(i), str(i), *row] for i, row in enumerate(ROWS)]),
        ((*NAMES, 'spare'), ROWS),
    ):
        with pytest.raises(InputError, match=r'names, but \d entries'):
            read(table(tmp_path / 'a.csv', rows, names))
    check(table(tmp_path / 'a.csv', [[*row, ''] for row in ROWS]))  # a delimiter ends each row
    check(table(tmp_path / 'a.csv', ROWS, (*NAMES, '')))
    check(table(tmp_path / 'a.csv', ROWS, (*NAMES, 'Comment')))


@pytest.mark.parametrize(
    ('row', 'words'),
    [
        (['0.020', '1', '2', '3', '4'], 'line 22 has 5 entries'),
        (['0.020', '1', '2'], 'line 22 has 3 entries'),
        (['# stopped'], 'without samples after sample 19'),
        (['0.020', '1', '2', '"3'], 'line 22 has 1 entries'),
    ],
)
def test_a_row_of_another_width_is_refused(tmp_path: Path, row: list[str], words: str) -> None:
    """More, fewer, a remark, a quote that does not end: the line is told."""
    path = table(tmp_path / 'a.csv', [*ROWS[:20], row, *ROWS[21:]])
    with pytest.raises(InputError, match=words):
        read(path)


def test_comments_among_the_samples(tmp_path: Path) -> None:
    """They refused a good file; where no clock tells that no sample is missing, they do."""
    end = [['# end of the file'], ['% 60 samples']]
    rows = [*ROWS[:20], ['# paused'], *ROWS[20:50], ['## note: load cell, changed'], *ROWS[50:]]
    for some in ([*rows, *end], [*ROWS, *end], [['# begin'], *ROWS]):
        check(table(tmp_path / 'a.csv', some))
        assert main(['map', str(tmp_path / 'a.csv')]) == 0
        assert 'rows' not in look(tmp_path / 'a.csv').layout
        sentence = [['# stopped by operator at 08:00']]
        check(table(tmp_path / 'a.csv', [*some, *sentence], by=' '))
    with pytest.raises(InputError, match='line 22'):
        read(table(tmp_path / 'a.csv', [*ROWS[:20], ['# 0.020', *ROWS[20][1:]], *ROWS[21:]]))
    untimed = parse_channel_map(
        {
            'rate': 1000,
            'command': {'column': 'command_mm', 'unit': 'mm'},
            'measured': {'column': 'measured_mm', 'unit': 'mm'},
        },
        'a map',
    )
    assert len(read(table(tmp_path / 'a.csv', [*ROWS, *end]), channels=untimed)) == COUNT
    with pytest.raises(InputError, match='line 22 has 1 entries'):
        read(table(tmp_path / 'a.csv', rows), channels=untimed)


@pytest.mark.parametrize('missing', [*PANDAS, *MSVC, *OTHERS])
def test_what_is_no_number_is_refused_where_it_is_needed(tmp_path: Path, missing: str) -> None:
    """Every spelling: told with its line in a needed column, passed over in another one."""
    rows = [[*row, row[3]] for row in ROWS]
    names = (*NAMES, 'spare')
    for column in range(4):
        odd = [*rows[40]]
        odd[column] = missing
        path = table(tmp_path / 'a.csv', [*rows[:40], odd, *rows[41:]], names)
        with pytest.raises(InputError, match=r'in 1 of 60 samples, first in line 42: ') as caught:
            read(path)
        assert repr(missing) in str(caught.value)
    odd = [*rows[40][:4], missing]
    path = table(tmp_path / 'a.csv', [*rows[:40], odd, *rows[41:]], names)
    check(path)
    values = look(path).columns[4].values
    assert not np.isfinite(values[40])
    np.testing.assert_array_equal(np.delete(values, 40), np.delete(FORCE, 40))


@pytest.mark.parametrize('decimal', [',', '.'])
def test_thousands_are_never_taken_for_fractions(tmp_path: Path, decimal: str) -> None:
    """-2.397 where the comma is decimal; 1,234 and 996 where nothing says what the comma is."""
    other = {',': '.', '.': ','}[decimal]
    grouped = [f'{f:,.0f}'.replace(',', other) for f in FORCE]
    rows = [
        [*(entry.replace('.', decimal) for entry in row[:3]), force]
        for row, force in zip(ROWS, grouped, strict=True)
    ]
    with pytest.raises(InputError, match=r'force .* line 2: .2.461'):
        read(table(tmp_path / 'a.csv', rows, by=';'))
    both = [[*row[:3], f'{force}{decimal}5'] for row, force in zip(rows, grouped, strict=True)]
    with pytest.raises(InputError, match=r'is decimal: export it without thousands'):
        read(table(tmp_path / 'a.csv', both, by=';'))
    whole = [
        [str(i), row[1].replace('.', ''), row[2].replace('.', ''), force]
        for i, (row, force) in enumerate(zip(ROWS, grouped, strict=True))
    ]
    names = ('time_ms', 'command_um', 'measured_um', 'force_N')
    with pytest.raises(InputError, match='2461 or a fraction'):
        read(table(tmp_path / 'a.csv', whole, names, ';'))


def test_line_ends_doubled_by_windows(tmp_path: Path) -> None:
    """CR CR LF is one line end; so is each of the others."""
    text = table(tmp_path / 'a.csv', ROWS).read_text()
    for end in ('\r\r\n', '\r\n', '\r', '\n\n'):
        (tmp_path / 'a.csv').write_bytes(text.replace('\n', end).encode('utf-16'))
        check(tmp_path / 'a.csv')
        assert len(look(tmp_path / 'a.csv').columns) == 4


@pytest.mark.parametrize('by', [',', ' ', ';'])
def test_names_that_numpy_wrote(tmp_path: Path, by: str) -> None:
    """The first line of numpy.savetxt is `# a,b,c`; the first row of numbers is a sample."""
    path = tmp_path / 'a.txt'
    np.savetxt(path, np.column_stack(COLUMNS), delimiter=by, header=by.join(NAMES))
    check(path)
    np.savetxt(path, np.column_stack(COLUMNS), delimiter=by, header='Test 7\n' + ', '.join(NAMES))
    check(path)
    np.savetxt(path, np.column_stack(COLUMNS), delimiter=by)
    places = [('time', 1, 's'), ('command', 2, 'mm'), ('measured', 3, 'mm')]
    described = {role: {'column': at, 'unit': unit} for role, at, unit in places}
    assert len(read(path, channels=parse_channel_map(described, 'map'))) == COUNT
    with pytest.raises(InputError, match='first line must name the columns'):
        read(path)


def test_a_first_line_of_a_spreadsheet_says_the_delimiter(tmp_path: Path) -> None:
    """`sep=;` is no name."""
    path = table(tmp_path / 'a.csv', ROWS, by='|')
    path.write_text('sep=|\n' + path.read_text())
    check(path)


def test_a_pipe_is_refused_before_it_is_read(tmp_path: Path) -> None:
    """It is opened twice: what it is, what it holds; as a record, a map, a bag."""
    for name in ('a.csv', 'a.mcap', 'a.mat', 'a.h5', 'a.tdms', 'a.xlsx', 'a.parquet'):
        path = tmp_path / name
        os.mkfifo(path)
        for use in (load_records, look, read_channel_map):
            with pytest.raises(InputError, match='pipe or a device'):
                use(path)


@pytest.mark.parametrize('mark', ['#', '%', '%%', '# '])
@pytest.mark.parametrize('by', [',', '\t', ' ', ';'])
@pytest.mark.parametrize('units', [True, False])
def test_names_and_units_in_comments(tmp_path: Path, mark: str, by: str, units: bool) -> None:
    """As numpy and MATLAB write them, with remarks above; read as they are, and by `map`."""
    names = [n.partition('_')[0] for n in NAMES] if units else list(NAMES)
    lines = [f'{mark} a test of Monday', f'{mark} {by.join(names)}']
    lines += [f'{mark} {by.join(["s", "mm", "mm", "N"])}'] if units else []
    text = '\n'.join([*lines, *map(by.join, ROWS)]) + '\n'
    (tmp_path / 'a.txt').write_text(text)
    check(tmp_path / 'a.txt')
    assert [column.unit for column in look(tmp_path / 'a.txt').columns] == ['s', 'mm', 'mm', 'N']


def test_units_of_no_column_are_nobodys(tmp_path: Path) -> None:
    """More of them than columns: which is whose is not told, and they are asked for."""
    lines = ['time,command,measured,force', 's,%,mm,mm,N', *map(','.join, ROWS)]
    (tmp_path / 'a.txt').write_text('\n'.join(lines) + '\n')
    with pytest.raises(InputError, match='has no unit'):
        read(tmp_path / 'a.txt')


@pytest.mark.parametrize(('by', 'inside'), [(',', '8800 (0,1):'), (';', 'axis 1;2, '), (',', '')])
def test_a_delimiter_in_brackets_parts_no_names(tmp_path: Path, by: str, inside: str) -> None:
    """Names of Instron's controllers, without quotes; by the map the units are theirs."""
    names = ['Total Time (s)', *(f'{n}({inside}{n}) ({u})' for n, u in BRACKETED)]
    path = table(tmp_path / 'a.csv', ROWS, tuple(names), by)
    columns = look(path).columns
    assert [column.name for column in columns] == names
    assert [column.unit for column in columns] == ['s', 'mm', 'mm', 'N']
    given = zip(
        ('time', 'command', 'measured', 'force'), names, ('s', 'mm', 'mm', 'N'), strict=True
    )
    channels = parse_channel_map({r: {'column': n, 'unit': u} for r, n, u in given}, 'map')
    record = read(path, channels=channels)
    np.testing.assert_allclose(record.measured, [1e-3 * float(row[2]) for row in ROWS], rtol=1e-12)


def test_a_delimiter_in_quotes_parts_no_name_either(tmp_path: Path) -> None:
    """Four names above five entries are refused: the fourth is no two."""
    rows = [[str(i), *row] for i, row in enumerate(ROWS)]
    path = table(tmp_path / 'a.csv', rows, ('time_s', 'command_mm', 'measured_mm', '"force, N"'))
    with pytest.raises(InputError, match='4 names, but 5 entries'):
        read(path)


def test_of_names_with_blanks_between_blanks_a_map_is_told(tmp_path: Path) -> None:
    path = tmp_path / 'a.txt'
    path.write_text('Time s Command mm Measured mm\n' + '0.1 1.5 2.5\n' * 9)
    with pytest.raises(InputError, match=r'6 names, but 3 entries.*--channels'):
        read(path)


@pytest.mark.parametrize('form', ['{:7.3f}{:8.4f}{:8.4f}{:6.0f}', '{:5.3f}{:8.4f}{:8.4f}{:7.0f}'])
def test_numbers_that_touch_are_told(tmp_path: Path, form: str) -> None:
    """Columns of a fixed width, too narrow for some rows or for all."""
    rows = [
        form.format(t, 10.0 * c - 5.0, 10.0 * m - 5.0, f)
        for t, c, m, f in zip(*COLUMNS, strict=True)
    ]
    path = tmp_path / 'a.txt'
    path.write_text('\n'.join([' '.join(NAMES), *rows]) + '\n')
    with pytest.raises(InputError, match='numbers touch each other: save them with a delimiter'):
        read(path)


def test_a_long_text_takes_little_more_than_its_numbers(tmp_path: Path) -> None:
    """About twice as long as `numpy.loadtxt` takes: rows are not parted to look for comments."""
    passed = np.arange(20_000) / 1000.0
    values = np.column_stack([passed, 10.0 * np.sin(passed), 10.0 * np.sin(passed - 0.01)])
    path = tmp_path / 'long.csv'
    np.savetxt(path, values, '%.9g', ',', header='time_s,command_mm,measured_mm', comments='')

    def took(read: Callable[[], object]) -> float:
        begin = process_time()
        read()
        return process_time() - begin

    ratios = [
        took(lambda: load_records(path))
        / took(lambda: np.loadtxt(path, delimiter=',', skiprows=1))
        for _ in range(5)
    ]
    assert min(ratios) < 5.0
