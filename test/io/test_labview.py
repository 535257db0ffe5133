"""LabVIEW's text measurement files, in the forms that its writer has."""

from pathlib import Path

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.io.laboratory import read
from actuator_glue.io.look import look

COUNT = 2000
COMMAND = 5 * np.sin(1e-5 * np.arange(COUNT) ** 2)  # mm
MEASURED = 1e3 * np.roll(COMMAND, 12)  # um
START = 1_714_730_400_123_000_000  # 2024-05-03 10:00:00.123 UTC [ns]
FILE = {
    'Writer_Version': '2',
    'Separator': 'Tab',
    'Decimal_Separator': '.',
    'Multi_Headings': 'No',
    'X_Columns': 'No',
    'Time_Pref': 'Relative',
    'Date': '2024/05/03',
    'Time': '10:00:00.123',
}
CHANNELS = {
    'Channels': '2',
    'Samples': ('2000', '2000'),
    'Date': ('2024/05/03', '2024/05/03'),
    'Time': ('10:00:00.1230000000', '10:00:00.1230000000'),
    'Y_Unit_Label': ('mm', 'um'),
    'X_Dimension': ('Time', 'Time'),
    'X0': ('0.0', '0.0'),
    'Delta_X': ('0.002', '0.002'),
}


def labview(
    path: Path,
    *,
    x: str = 'No',
    by: str = '\t',
    decimal: str = '.',
    first: float = 0.0,
    comment: str | None = None,
    file: dict | None = None,
    channels: dict | None = None,
) -> Path:
    """Write a file: `x` as its heading calls it; `file` and `channels` change the headings."""
    words = {'\t': 'Tab', ',': 'Comma', ';': 'Semicolon'}
    of_file = {**FILE, 'X_Columns': x, 'Separator': words[by], 'Decimal_Separator': decimal}
    lines = [f'LabVIEW Measurement{by}']
    lines += [f'{k}{by}{v}' for k, v in {**of_file, **(file or {})}.items()]
    lines += [f'***End_of_Header***{by}', by]
    between = by * 2 if x == 'Multi' else by
    for key, entries in {**CHANNELS, **(channels or {})}.items():
        entries = (entries,) if isinstance(entries, str) else entries
        lines.append(f'{key}{by}{between.join(entries)}{by}'.replace('0.', f'0{decimal}'))
    lines.append(f'***End_of_Header***{by}{by}{by}')
    names = ['X_Value', 'Command', *(['X_Value'] if x == 'Multi' else []), 'Measured', 'Comment']
    lines.append(by.join(names))
    for i, (u, y) in enumerate(zip(COMMAND, MEASURED, strict=True)):
        time = '' if x == 'No' else f'{first + i * 2e-3:.6f}'
        row = [time, f'{u:.6f}', *([time] if x == 'Multi' else []), f'{y:.6f}']
        row += [comment] if comment is not None and i == 3 else []
        lines.append(by.join(row).replace('.', decimal))
    path.write_text('\r\n'.join(lines) + '\r\n', encoding='cp1252')
    return path


def check(path: Path, start_ns: int = START) -> None:
    """Compare with what was written."""
    record = read(path)
    np.testing.assert_allclose(record.command, COMMAND * 1e-3, atol=1e-9)
    np.testing.assert_allclose(record.measured, MEASURED * 1e-6, atol=1e-11)
    assert record.period == 2e-3
    assert record.start_ns == pytest.approx(start_ns, abs=600)


@pytest.mark.parametrize('comment', [None, 'touched it, sorry'])
@pytest.mark.parametrize('x', ['No', 'One', 'Multi'])
@pytest.mark.parametrize(('by', 'decimal'), [('\t', '.'), ('\t', ','), (';', ','), (',', '.')])
def test_every_form_is_read(
    tmp_path: Path, x: str, by: str, decimal: str, comment: str | None
) -> None:
    """Times in a column, for each channel, or in the heading; separators; units; a comment."""
    path = labview(tmp_path / 'a.lvm', x=x, by=by, decimal=decimal, comment=comment)
    check(path)
    path.rename(tmp_path / 'a.txt')  # known by its first bytes
    check(tmp_path / 'a.txt')
    found = look(tmp_path / 'a.txt')
    assert [column.unit for column in found.columns][-2:] == ['mm', 'um']


@pytest.mark.parametrize('coding', ['cp1252', 'utf-8', 'utf-8-sig', 'utf-16', 'utf-16-le'])
def test_however_the_text_is_coded(tmp_path: Path, coding: str) -> None:
    """Known by its first bytes behind a mark of the coding, too; the unit is its own."""
    path = labview(tmp_path / 'a.lvm', channels={'Y_Unit_Label': ('mm', 'µm')})
    path.write_text(path.read_text('cp1252'), encoding=coding)
    check(path)
    check(path.rename(tmp_path / 'a.txt'))


def test_units_stand_above_their_columns(tmp_path: Path) -> None:
    """A channel without a unit moves that of no other one, with a column of times for each."""
    for unit in (('', 'um'), ('mm', '')):
        path = labview(tmp_path / 'a.lvm', x='Multi', channels={'Y_Unit_Label': unit})
        assert [column.unit for column in look(path).columns][1:] == [*unit]


def test_a_first_column_that_is_no_time_has_no_heading(tmp_path: Path) -> None:
    """Entries begin above the second column: the last one is not the first column's."""
    for unit in (('mm', 'um'), ('', 'um'), ('',)):
        path = labview(tmp_path / 'a.lvm', channels={'Y_Unit_Label': unit})
        path.write_text(path.read_text('cp1252').replace('X_Value', 'Valve'), 'cp1252')
        valve = next(column for column in look(path).columns if column.name == 'Valve')
        assert valve.unit == ''
    path = labview(tmp_path / 'a.lvm', x='One')
    path.write_text(path.read_text('cp1252').replace('X_Value', 'Seconds'), 'cp1252')
    with pytest.raises(InputError, match='no column is called X_Value'):
        look(path)


def test_where_time_begins(tmp_path: Path) -> None:
    """`X0` is later than the date; absolute times count from 1904; without a date from 0."""
    check(labview(tmp_path / 'a.lvm', channels={'X0': ('0.5', '0.5')}), START + 500_000_000)
    check(labview(tmp_path / 'a.lvm', x='One', first=0.5), START + 500_000_000)
    for x, absolute in (('No', {'X0': ('3797575200.123',) * 2}), ('One', {})):
        check(labview(tmp_path / 'a.lvm', x=x, first=3797575200.123, channels=absolute))
    nothing = {'Date': '', 'Time': ''}
    check(labview(tmp_path / 'a.lvm', file=nothing, channels=nothing), 0)


@pytest.mark.parametrize(
    ('changed', 'words'),
    [
        ({'Delta_X': ('0.002', '0.001')}, 'Delta_X differs between channels'),
        ({'X0': ('0.0', '0.004')}, 'X0 differs between channels'),
        ({'Time': ('10:00:00', '10:00:01')}, 'Time differs between channels'),
        ({'X_Dimension': ('Frequency', 'Frequency')}, 'over Frequency, not over time'),
        ({'Delta_X': ''}, 'Delta_X is .*no column of times'),
        ({'Samples': ('4000', '4000')}, 'Samples is 4000, and 2000 rows follow: the file is cut'),
    ],
)
def test_channels_without_a_common_clock_are_refused(
    tmp_path: Path, changed: dict, words: str
) -> None:
    """Other steps, other starts, no time at all."""
    with pytest.raises(InputError, match=words):
        read(labview(tmp_path / 'a.lvm', channels=changed))


@pytest.mark.parametrize(
    ('x', 'changed', 'words'),
    [
        ('One', {'X0': ('0.0', '0.1')}, 'X0 differs between channels'),
        ('One', {'Delta_X': ('0.003', '0.003')}, 'Delta_X is 0.003, but X_Value goes up by 0.002'),
        ('One', {'Delta_X': ('0.002', '0.001')}, 'Delta_X differs between channels'),
        ('Multi', {'Delta_X': ('0.004', '0.004')}, 'Delta_X is 0.004, but .* up by 0.002'),
        ('One', {'Samples': ('4000', '4000')}, 'Samples is 4000, and 2000 rows follow'),
    ],
)
def test_a_column_of_times_that_the_heading_contradicts_is_refused(
    tmp_path: Path, x: str, changed: dict, words: str
) -> None:
    """Nobody knows which is wrong; a heading of an appended file counts its first rows alone."""
    with pytest.raises(InputError, match=words):
        read(labview(tmp_path / 'a.lvm', x=x, channels=changed))
    check(labview(tmp_path / 'b.lvm', x=x, channels={'Samples': ('100', '100')}))


@pytest.mark.parametrize(
    'changed',
    [
        {'Samples': ('1', '1'), 'Delta_X': ('1.000000', '1.000000')},
        {'Samples': ('0', '0'), 'Delta_X': ('1.0', '1.0'), 'X0': ('0.0', '0.1')},
        {'Samples': ('100', '100'), 'Delta_X': ('1.000000', '1.000000')},
        {'Delta_X': ('0.0002', '0.0002')},
        {'Delta_X': ('0.002', '0.0020')},
        {'X0': ('0.0', '0.002')},
    ],
)
def test_a_heading_that_says_less_than_the_column_of_times_is_no_contradiction(
    tmp_path: Path, changed: dict
) -> None:
    """Single samples and appended rows, a step before decimation, starts a sample apart."""
    check(labview(tmp_path / 'a.lvm', x='One', channels=changed))


@pytest.mark.parametrize(('step', 'told'), [('0.0002', True), ('0.002', False)])
def test_that_samples_were_left_out_is_told(tmp_path: Path, step: str, told: bool) -> None:
    """The heading has the step of all samples, the rows that of those that were kept."""
    found: list[str] = []
    path = labview(tmp_path / 'a.lvm', x='One', channels={'Delta_X': (step, step)})
    read(path, warn=found.append)
    assert ['of 10 samples one was kept' in line for line in found] == [True] * told


def test_a_step_of_few_digits_is_the_one_that_it_was_rounded_from(tmp_path: Path) -> None:
    """A third of a millisecond may be 0.0003, and nothing else with one digit."""
    path = labview(tmp_path / 'a.lvm', x='One', channels={'Delta_X': ('0.0003', '0.0003')})
    top, names, rows = path.read_text('cp1252').partition('X_Value\tCommand\tMeasured\tComment\n')
    table = [line.split('\t') for line in rows.splitlines() if line.strip()]
    for step, good in ((1.0 / 3000.0, True), (0.0004, False)):
        lines = ['\t'.join([f'{i * step:.9f}', *row[1:]]) for i, row in enumerate(table)]
        path.write_text('\n'.join([top + names + lines[0], *lines[1:]]), 'cp1252')
        if good:
            assert read(path).period == pytest.approx(step, rel=1e-5)
            continue
        with pytest.raises(InputError, match=r'Delta_X is 0\.0003, but .* up by 0\.0004'):
            read(path)


def segments(path: Path, x: str, starts: list[float], *, again: bool = False, **changed) -> Path:
    """Write a file of segments that begin so long after the first [s]; `again` for whole heads."""
    parts = []
    for start in starts:
        clock = f'10:00:{start + 0.123:013.10f}'
        channels = {'Time': (clock, clock), **changed.get(f'{start:g}', {})}
        parts.append(labview(path, x=x, file={'Multi_Headings': 'Yes'}, channels=channels))
        parts[-1] = path.read_text('cp1252')
    heads = [part if again else part.partition('***End_of_Header***\t\n')[2] for part in parts]
    path.write_text('\n'.join([parts[0], *heads[1:]]))
    return path


@pytest.mark.parametrize('again', [False, True])
@pytest.mark.parametrize('x', ['No', 'One', 'Multi'])
def test_segments_that_follow_each_other_are_one_record(
    tmp_path: Path, x: str, again: bool
) -> None:
    """Each with a heading, or appended with all headings: their dates say when they begin."""
    record = read(segments(tmp_path / 'a.lvm', x, [0.0, 4.0, 8.0], again=again))
    np.testing.assert_allclose(record.command, np.tile(COMMAND * 1e-3, 3), atol=1e-9)
    assert record.period == 2e-3
    assert record.start_ns == pytest.approx(START, abs=600)


def test_segments_that_do_not_are_refused(tmp_path: Path) -> None:
    """A gap between two, one that begins before the last has ended, no date, other channels."""
    path = tmp_path / 'a.lvm'
    with pytest.raises(InputError, match='without samples after sample 1999'):
        read(segments(path, 'No', [0.0, 4.5]))
    with pytest.raises(InputError, match='time goes back at sample 2000'):
        read(segments(path, 'No', [0.0, 3.0]))
    nothing = {'Date': ('', ''), 'Time': ('', '')}
    whole = labview(path, file={'Date': '', 'Time': ''}, channels=nothing).read_text()
    path.write_text(whole + whole)
    with pytest.raises(InputError, match='no date says when'):
        read(path)
    other = {'4': {'Y_Unit_Label': ('mm', 'kN')}}
    with pytest.raises(InputError, match='several measurements of different channels'):
        read(segments(path, 'No', [0.0, 4.0], **other))


def test_text_that_is_only_called_so_is_text(tmp_path: Path) -> None:
    """LabVIEW writes no heading where it is told so."""
    rows = np.column_stack([np.arange(COUNT) * 2e-3, COMMAND, MEASURED])
    head = 'time_s\tcommand_mm\tmeasured_um'
    np.savetxt(tmp_path / 'a.lvm', rows, delimiter='\t', header=head, comments='')
    check(tmp_path / 'a.lvm', 0)
    assert look(tmp_path / 'a.lvm').what == 'delimited text'


@pytest.mark.parametrize('step', ['0', '-0.002', 'nan', 'x'])
def test_a_step_that_is_none_is_refused_by_whoever_reads(tmp_path: Path, step: str) -> None:
    """`map` ended in a division by zero."""
    path = labview(tmp_path / 'a.lvm', channels={'Delta_X': (step, step)})
    for each in (read, look):
        with pytest.raises(InputError, match=rf"Delta_X is '{step}', but there is no column of"):
            each(path)
