"""Stiffness, hold and name that a file states: nearly right is not passed over."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pandas as pd
import pyarrow.parquet as pq
import pytest
from nptdms import ChannelObject, GroupObject, TdmsWriter
from scipy.io import savemat

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.laboratory import read

TIME = np.arange(1000) * 1e-3
COLUMNS = {'time_s': TIME, 'command_mm': np.sin(30 * TIME), 'measured_mm': np.sin(30 * TIME - 0.1)}


def text(path: Path, *comments: str) -> Path:
    """Write a text with comments above the names."""
    head = '\n'.join([*comments, ','.join(COLUMNS)])
    rows = np.column_stack(list(COLUMNS.values()))
    np.savetxt(path, rows, fmt='%.6f', delimiter=',', header=head, comments='')
    return path


@pytest.mark.parametrize('sign', ['=', ' = ', ':', ': '])
def test_capitals_and_colons_are_read(tmp_path: Path, sign: str) -> None:
    """What can be meant in one way only is taken; other comments are left alone."""
    said = [f'# Hold{sign}linear', f'# STIFFNESS_N_per_m{sign}250e3', f'% Actuator{sign}mts 3']
    prose = ['# Test 7: hold on', '# Stiffness: see drawing', '# hold_time = 5', '# a = b = c']
    record = read(text(tmp_path / 'a.csv', *said, *prose))
    assert (record.hold, record.stiffness, record.actuator) == ('linear', 250e3, 'mts 3')


@pytest.mark.parametrize(
    ('note', 'said'),
    [
        ('stiffness = 250e3', '`stiffness_N_per_m = VALUE`, which is the specimen stiffness'),
        ('stiffness: 250e3', 'stiffness_N_per_m'),
        ('Stiffness: 250 N/mm, steel', 'stiffness_N_per_m'),
        ('specimen stiffness: 1.4 kips/in', 'stiffness_N_per_m'),
        ('hold mode: ramp', '`hold = VALUE`'),
        ('Stiffness [kN/m]: 250', 'stiffness_N_per_m'),
        ('hold type: linear', '`hold = VALUE`'),
        ('command hold: zero order', '`hold = VALUE`'),
        ('Stiffness [N/m] = 250e3', 'stiffness_N_per_m'),
        ('specimen stiffness = 250e3', 'stiffness_N_per_m'),
        ('stiffness_kN_per_mm = 0.25', 'stiffness_N_per_m'),
        ('stifness_N_per_m = 250e3', 'stiffness_N_per_m'),
        ('hold_type = linear', '`hold = VALUE`, which is zoh or linear'),
    ],
)
def test_notes_nearly_right_are_refused(tmp_path: Path, note: str, said: str) -> None:
    """Passed over, the hold would be zoh: half a sample of delay that is none."""
    with pytest.raises(InputError, match=r'a\.csv: the note .* is not understood; write') as found:
        read(text(tmp_path / 'a.csv', f'# {note}'))
    assert said in str(found.value)
    assert f"the note '{note}' is" in str(found.value)


@pytest.mark.parametrize(
    'prose',
    [
        'Stiffness: none',
        'Specimen stiffness: none',
        'Stiffness: linear',
        'Stiffness: held constant',
        'stiffness: zero',
        'stiffness: 12 mm plate',
        'Stiffness: 3 springs in parallel',
        'Command hold: first second',
        'hold type: 1',
        'hold mode: none',
    ],
)
def test_prose_behind_a_colon_is_no_note(tmp_path: Path, prose: str) -> None:
    """What states no stiffness and no hold, whatever its words are elsewhere."""
    record = read(text(tmp_path / 'a.csv', f'# {prose}'))
    assert (record.hold, record.stiffness) == ('zoh', None)


def test_notes_said_twice_are_refused(tmp_path: Path) -> None:
    """The last would win; twice the same is said once."""
    for second in ('# hold = zoh', '# Hold: zoh'):
        with pytest.raises(InputError, match=r"old is said twice, 'linear' and 'zoh'; keep one"):
            read(text(tmp_path / 'a.csv', '# hold = linear', second))
    assert read(text(tmp_path / 'a.csv', *['# hold = linear'] * 2)).hold == 'linear'


def test_attributes_are_notes_too(tmp_path: Path) -> None:
    """Read whatever their capitals; nearly right ones are refused as in a text."""
    path = tmp_path / 'a.h5'
    with h5py.File(path, 'w') as file:
        for name, values in COLUMNS.items():
            file[name] = values
        file.attrs['Hold'] = 'linear'
    assert read(path).hold == 'linear'
    with h5py.File(path, 'a') as file:
        file.attrs['stiffness'] = 250e3
    with pytest.raises(InputError, match=r"'stiffness = 250000.0' is not understood"):
        read(path)


MAP = {
    'time': {'column': 'time_s', 'unit': 's'},
    'command': {'column': 'command_mm', 'unit': 'mm'},
    'measured': {'column': 'measured_mm', 'unit': 'mm'},
}


@pytest.mark.parametrize('lines', [None, 4])
def test_what_a_channel_map_leaves_out_is_as_the_file_says(
    tmp_path: Path, lines: int | None
) -> None:
    """The hold was zoh and the stiffness unknown, without a word; what the map says counts."""
    said = ['# hold = linear', '# stiffness_N_per_m = 250e3', '# actuator = mts 3']
    path = text(tmp_path / 'a.csv', *said)
    heads = {} if lines is None else {'header_lines': lines}
    record = read(path, channels=parse_channel_map(MAP | heads, 'a map'))
    assert (record.hold, record.stiffness, record.actuator) == ('linear', 250e3, 'mts 3')
    own = {'hold': 'zoh', 'stiffness': 0, 'actuator': 'other'}
    record = read(path, channels=parse_channel_map(MAP | heads | own, 'a map'))
    assert (record.hold, record.stiffness, record.actuator) == ('zoh', 0.0, 'other')


def test_beside_a_channel_map_nearly_right_is_prose(tmp_path: Path) -> None:
    """Whoever describes a file by a map need not mend what stands in it."""
    path = text(tmp_path / 'a.csv', '# stiffness = 250e3', '# hold type: linear')
    record = read(path, channels=parse_channel_map(MAP | {'hold': 'zoh'}, 'a map'))
    assert (record.hold, record.stiffness) == ('zoh', None)


def test_beside_a_channel_map_the_hold_of_a_load_is_prose(tmp_path: Path) -> None:
    path = text(tmp_path / 'a.csv', '# Hold: 5 s', '# Stiffness_N_per_m: see drawing')
    record = read(path, channels=parse_channel_map(MAP, 'a map'))
    assert (record.hold, record.stiffness) == ('zoh', None)
    path = text(tmp_path / 'b.csv', '# hold: foh')
    with pytest.raises(InputError, match="it says that its hold is 'foh'"):
        read(path, channels=parse_channel_map(MAP, 'a map'))


@pytest.mark.parametrize('sign', [':', ' ='])
@pytest.mark.parametrize(
    'value',
    [
        '5 s',
        '5',
        '30 min at each level',
        '10 kN',
        '2.5 mm',
        '3 cycles',
        'none',
        '',
        '?',
        'unknown',
    ],
)
def test_the_hold_of_a_load_is_none_of_the_command(tmp_path: Path, value: str, sign: str) -> None:
    """It refused a good file; beside it the hold of the command counts, in any order."""
    said, ours = f'# Hold{sign} {value}', '# hold = linear'
    assert read(text(tmp_path / 'a.csv', said)).hold == 'zoh'
    for lines in ((said, ours), (ours, said), (said.replace('H', 'h'), ours)):
        assert read(text(tmp_path / 'a.csv', *lines)).hold == 'linear'


def test_values_in_capitals_with_their_unit_and_none(tmp_path: Path) -> None:
    """Each was refused, and says what it says."""
    said = ['# Hold: Linear', '# stiffness_N_per_m = 250e3 N/m', '# actuator: -']
    record = read(text(tmp_path / 'a.csv', *said))
    assert (record.hold, record.stiffness, record.actuator) == ('linear', 250e3, 'actuator')
    for nothing in ('unknown', 'none', '-', ''):
        said = ['# Hold: ZOH', f'# stiffness_N_per_m = {nothing}']
        record = read(text(tmp_path / 'a.csv', *said))
        assert (record.hold, record.stiffness) == ('zoh', None)
    with pytest.raises(InputError, match=r"= '250 kN/m' is not a number"):
        read(text(tmp_path / 'a.csv', '# stiffness_N_per_m = 250 kN/m'))


@pytest.mark.parametrize(
    'value', ['1', '0', '1st', '1st order', 'foh', 'linaer', '2 points, linear', 'yes', 'held']
)
def test_what_may_be_the_hold_of_the_command_is_refused(tmp_path: Path, value: str) -> None:
    with pytest.raises(InputError, match='it says that its hold is'):
        read(text(tmp_path / 'a.csv', f'# Hold: {value}'))


@pytest.mark.parametrize('holds', [('5.0',), ('5.0', '10.0')])
def test_the_hold_of_a_load_in_a_group_is_none(tmp_path: Path, holds: tuple[str, ...]) -> None:
    told: list[str] = []
    record = read(grouped(tmp_path / 'a.h5', *holds), warn=told.append)
    assert (record.hold, record.stiffness) == ('zoh', 250e3)
    assert not told


def test_a_hold_that_is_none_is_told_with_what_to_do(tmp_path: Path) -> None:
    path = text(tmp_path / 'a.csv', '# hold: foh')
    with pytest.raises(InputError, match=r"a\.csv: it says that its hold is 'foh'; write zoh or"):
        read(path)
    assert read(path, hold='linear').hold == 'linear'
    assert read(path, channels=parse_channel_map(MAP | {'hold': 'zoh'}, 'a map')).hold == 'zoh'


def grouped(path: Path, *holds: str) -> Path:
    """Write groups with attributes; the first one has the channels."""
    with h5py.File(path, 'w') as file:
        for number, hold in enumerate(holds):
            group = file.create_group(f'run {number}')
            group.attrs.update({'hold': hold, 'stiffness_N_per_m': 250e3, 'stiffness': 'of steel'})
            for name, values in COLUMNS.items():
                group[name if not number else f'old_{name}'] = values
    return path


def test_what_a_group_says_counts(tmp_path: Path) -> None:
    """Only attributes of the file itself did: the hold was zoh without a word."""
    record = read(grouped(tmp_path / 'a.h5', 'linear', 'linear'))
    assert (record.hold, record.stiffness) == ('linear', 250e3)
    record = read(tdms(tmp_path / 'a.tdms', hold='linear', stiffness_N_per_m=250e3))
    assert (record.hold, record.stiffness) == ('linear', 250e3)


def tdms(path: Path, **said: object) -> Path:
    """Write a group with properties and channels."""
    with TdmsWriter(str(path)) as file:
        channels = [ChannelObject('g', name, values) for name, values in COLUMNS.items()]
        file.write_segment([GroupObject('g', properties=said), *channels])
    return path


def of_group(path: Path, **said: object) -> Path:
    """Write a group with attributes and channels."""
    with h5py.File(path, 'w') as file:
        group = file.create_group('g')
        group.update(COLUMNS)
        group.attrs.update(said)
    return path


def sheet(path: Path, **said: object) -> Path:
    """Write a workbook with settings in two cells, a number's unit in a third."""
    book = openpyxl.Workbook()
    for name, value in said.items():
        number, _, unit = str(value).partition(' ')
        with_unit = [float(number), unit] if unit and number.isdigit() else [value]
        book.active.append([name, *with_unit])
    book.active.append(list(COLUMNS))
    for row in zip(*COLUMNS.values(), strict=True):
        book.active.append(row)
    book.save(path)
    return path


GROUPED = [('a.tdms', tdms), ('a.h5', of_group), ('a.xlsx', sheet)]


@pytest.mark.parametrize(('name', 'make'), GROUPED)
@pytest.mark.parametrize(
    ('said', 'meant'),
    [
        ({'Stiffness': 250e3}, 'stiffness_N_per_m'),
        ({'specimen stiffness': '250 N/mm'}, 'stiffness_N_per_m'),
        ({'hold type': 'linear'}, 'hold'),
    ],
)
def test_settings_nearly_right_are_refused_in_each_format(
    tmp_path: Path, name: str, make: Callable[..., Path], said: dict[str, object], meant: str
) -> None:
    """Of sheets and groups they were left out without a word."""
    path = make(tmp_path / name, **said)
    with pytest.raises(InputError, match=f'is not understood; write `{meant} = VALUE`'):
        read(path)
    content = parse_channel_map(MAP | {'hold': 'linear'}, 'a map')
    assert read(path, channels=content).hold == 'linear'


@pytest.mark.parametrize(('name', 'make'), GROUPED)
def test_words_of_a_laboratory_are_no_settings(
    tmp_path: Path, name: str, make: Callable[..., Path]
) -> None:
    own = {'stiffness': 'of steel', 'hold': '5 s', 'hold mode': 'none', 'Specimen': 'spring 3'}
    record = read(make(tmp_path / name, actuator='mts 3', **own))
    assert (record.hold, record.stiffness, record.actuator) == ('zoh', None, 'mts 3')


def test_a_stiffness_in_a_sheet_may_have_its_unit_beside_it(tmp_path: Path) -> None:
    """It was left out without a word."""
    assert read(sheet(tmp_path / 'a.xlsx', stiffness_N_per_m='250000 N/m')).stiffness == 250e3


def test_groups_that_differ_are_told(tmp_path: Path) -> None:
    """The file is read; what counts only a person knows."""
    told: list[str] = []
    record = read(grouped(tmp_path / 'a.h5', 'linear', 'zoh'), warn=told.append)
    assert (record.hold, record.stiffness) == ('zoh', 250e3)
    (line,) = told
    assert 'its groups have different hold (linear, zoh), and none is taken' in line


def variables(path: Path, **said: object) -> Path:
    """Write variables beside the columns, as MATLAB 5, MATLAB 7.3 or HDF5."""
    if path.suffix == '.mat':
        savemat(path, {**COLUMNS, **said})
        return path
    with h5py.File(path, 'w') as file:
        for name, value in {**COLUMNS, **said}.items():
            file[name] = value
    return path


@pytest.mark.parametrize('name', ['a.mat', 'a.h5'])
def test_variables_are_notes_whatever_their_capitals(tmp_path: Path, name: str) -> None:
    """`Hold` was passed over without a word: zoh, half a sample of delay that is none."""
    path = tmp_path / name
    said = {'Hold': 'linear', 'STIFFNESS_N_per_m': 250e3, 'Actuator': 'mts 3'}
    record = read(variables(path, **said))
    assert (record.hold, record.stiffness, record.actuator) == ('linear', 250e3, 'mts 3')
    with pytest.raises(InputError, match=r'`hold = VALUE`, which is zoh or linear'):
        read(variables(path, hold_type='linear'))
    # The hold of a load, the test's own words, and numbers of the laboratory's model.
    own = {'Hold': '5 s', 'hold_mode': 'displacement', 'stiffness': 3.0, 'HOLD_TIME': 5.0}
    record = read(variables(path, **own))
    assert (record.hold, record.stiffness) == ('zoh', None)


def test_attributes_of_a_dataframe_are_notes(tmp_path: Path) -> None:
    """As pandas writes them into Parquet; whatever else is called so is none."""
    frame, path = pd.DataFrame(COLUMNS), tmp_path / 'a.parquet'
    frame.attrs = {'hold': 'linear', 'stiffness_N_per_m': 250e3, 'operator': 'nobody'}
    frame.to_parquet(path)
    record = read(path)
    assert (record.hold, record.stiffness) == ('linear', 250e3)
    table = pq.read_table(path)
    for odd in ('[1, 2]', '{broken'):
        pq.write_table(table.replace_schema_metadata({'PANDAS_ATTRS': odd}), path)
        assert (read(path).hold, read(path).stiffness) == ('zoh', None)
