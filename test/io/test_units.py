"""Units in the names of columns: every way to write one, and what is no length."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.laboratory import read
from actuator_glue.io.look import ColumnLook, FileLook, look
from actuator_glue.io.propose import propose
from actuator_glue.io.units import ROLES, contradict, recognise, symbol, written_unit
from actuator_glue.motion import MOTIONS

COUNT = 1000
TIME = np.arange(COUNT) * 1e-3
COMMAND = 3 * np.sin(40 * TIME**2)
MEASURED = np.roll(COMMAND, 8)


def table(path: Path, names: list[str], by: str = ',') -> Path:
    """Write time, command and measured below these names."""
    rows = np.column_stack([TIME, COMMAND, MEASURED])
    np.savetxt(path, rows, fmt='%.6f', delimiter=by, header=by.join(names), comments='')
    return path


@pytest.mark.parametrize(
    ('head', 'seconds'),
    [
        ('time (min),command_mm,measured_mm', 60.0),
        ('time_min,command_mm,measured_mm', 60.0),
        ('Time [Minutes],command_mm,measured_mm', 60.0),
        ('time,command,measured\nmin,mm,mm', 60.0),
        ('time (h),command_mm,measured_mm', 3600.0),
        ('time_hours,command_mm,measured_mm', 3600.0),
        ('t [min],cmd [mm],pos [mm]', 60.0),
        ('Zeit [min],Sollweg [mm],Istweg [mm]', 60.0),
    ],
)
def test_times_in_minutes_and_hours(tmp_path: Path, head: str, seconds: float) -> None:
    """Both wanted a `scale`; where the names say no roles, `map` proposes the unit."""
    path = tmp_path / 'a.csv'
    rows = np.column_stack([TIME / seconds, COMMAND, MEASURED])
    np.savetxt(path, rows, fmt='%.12f', delimiter=',', header=head, comments='')
    if not head.lower().startswith('time'):
        assert main(['map', str(path), '--out', str(tmp_path / 'map.yaml')]) == 0
        assert 'unit: "min"' in (tmp_path / 'map.yaml').read_text()
        assert read(path, channels=tmp_path / 'map.yaml').period == 1e-3
    else:
        assert read(path).period == 1e-3


def test_a_line_of_statistics_is_no_line_of_units(tmp_path: Path) -> None:
    """`min` and `max` name columns there, and what stands above them does not."""
    head = 'Position,,Force\nmin,max,mean\n'
    rows = ''.join(f'{i},{2 * i},{3 * i}\n' for i in range(50))
    (tmp_path / 'a.csv').write_text(head + rows)
    assert [c.label for c in look(tmp_path / 'a.csv').columns] == ['min', 'max', 'mean']


@pytest.mark.parametrize(
    'form', ['{}_{}', '{} [{}]', '{}/{}', '{} / {}', '{} in {}', '{} ({})', '{}; {}', '{} {}']
)
def test_every_way_to_write_a_unit(tmp_path: Path, form: str) -> None:
    """Read as what it says; `map` shows it and has nothing to ask."""
    units = {'time': 's', 'command': 'um', 'measured': 'mm'}
    names = [form.format(role, unit) for role, unit in units.items()]
    path = table(tmp_path / 'a.csv', names)
    record = read(path)
    np.testing.assert_allclose(record.command, COMMAND * 1e-6, atol=1e-12)
    np.testing.assert_allclose(record.measured, MEASURED * 1e-3, atol=1e-9)
    assert [recognise(name) for name in names] == list(units.items())
    assert [column.unit for column in look(path).columns] == list(units.values())


@pytest.mark.parametrize(
    ('name', 'unit'),
    [
        ('Sollweg (mm) (gefiltert)', 'mm'),
        ('cmd_mm_filtered', 'mm'),
        ('Kraft F / kN', 'kN'),
        ('command_ft', 'ft'),
        ('time_min', 'min'),
        ('Load min', ''),
        ('disp_h', ''),
        ('t [h]', 'h'),
        ('Disp amp', ''),
        ('Axial Strain', ''),
        ('cmd_ft', 'ft'),
        ('Velocity mm/s', 'mm/s'),
        ('Stroke [furlong]', 'furlong'),
        ('POS_MM', 'MM'),
        ('Angle [°]', '°'),
        ('U [V]', 'V'),
        ('data(:,2)', ''),
        ('rec.Y(1).Data', ''),
        ('Boom Ms', ''),
        ('Oil in temp', ''),
        ('in', ''),
    ],
)
def test_a_unit_is_seen_where_it_is_written(name: str, unit: str) -> None:
    """In brackets, within a name, of no length; and none where none is."""
    assert written_unit(name) == unit


@pytest.mark.parametrize('unit', ['deg', 'rad', '°', 'mrad', 'counts', 'V', '%'])
def test_a_motion_of_its_own_is_never_a_length(tmp_path: Path, unit: str) -> None:
    """Kept by name and in a proposed map, never taken as mm; a length by the arm of a lever."""
    path = table(tmp_path / 'a.csv', ['time_s', f'command_{unit}', f'measured_{unit}'])
    motion, inside = MOTIONS[unit]
    record = read(path)
    assert record.motion == motion
    np.testing.assert_allclose(record.command, COMMAND * inside, atol=1e-6 * inside)
    path = table(tmp_path / 'b.csv', ['t [s]', f'Soll [{unit}]', f'Ist [{unit}]'])
    assert main(['map', str(path), '--out', str(tmp_path / 'map.yaml')]) == 0
    mapped = read(path, channels=tmp_path / 'map.yaml')
    np.testing.assert_array_equal(mapped.measured, record.measured)
    assert mapped.motion == motion
    described = {'time': {'column': 1, 'unit': 's'}}
    for role, column in (('command', 2), ('measured', 3)):
        described[role] = {'column': column, 'unit': 'mm', 'scale': 4.0}
    record = read(path, channels=parse_channel_map(described, 'map'))
    np.testing.assert_allclose(record.command, COMMAND * 4e-3, atol=1e-8)
    assert record.motion == 'm'


def test_a_unit_of_something_else_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Volts are no length: refused by name; `map` says what is written and what it needs."""
    with pytest.raises(InputError, match=r"unit 'V', which is none of displacement.*scale"):
        read(table(tmp_path / 'a.csv', ['time_s', 'command_V', 'measured_mm']))
    path = table(tmp_path / 'a.csv', ['t [s]', 'Sollwert [V]', 'Istwert [mm]'])
    assert main(['map', str(path)]) == 0
    shown = capsys.readouterr().out
    assert "CHECK unit: the file says 'V': give mm per V as `scale`" in shown
    assert 'states none' not in shown


@pytest.mark.parametrize(
    ('units', 'said'),
    [
        ('s,m,mm', "'command_mm' has unit 'mm' in its name, and the file gives 'm'"),
        ('ms,mm,mm', "'time_s' .* 's' .* 'ms'"),
        ('[s],[mm],[in]', "'measured_mm' .* 'in'"),
        ('s,mm,V', "'measured_mm' .* 'V'"),
        ('s,mm,mm/s', "'measured_mm' .* 'mm/s'"),
        ('s,mm,Volts', "'measured_mm' .* 'Volts'"),
        ('s,mm,Inches', "'measured_mm' .* 'Inches'"),
        ('s,meters,mm', "'command_mm' .* 'meters'"),
        ('s,METRES,mm', "'command_mm' .* 'METRES'"),
        ('s,mm,Degrees', "'measured_mm' .* 'Degrees'"),
        ('s,mm,Newtons', "'measured_mm' .* 'Newtons'"),
        ('s,mm,Mm', "'measured_mm' .* 'Mm'"),
        ('s,mm,feet', "'measured_mm' .* 'feet'"),
        ('s,mm,mm/min', "'measured_mm' .* 'mm/min'"),
        ('s,mm,Length (m)', r"'measured_mm' .* 'Length \(m\)'"),
        ('s,mm,m abs', "'measured_mm' .* 'm abs'"),
        ('s,mm,CM', "'measured_mm' .* 'CM'"),
        ('Minutes,mm,mm', "'time_s' .* 'Minutes'"),
    ],
)
def test_units_that_contradict_are_refused(tmp_path: Path, units: str, said: str) -> None:
    """In the name and beside it: nobody knows which is wrong."""
    path = table(tmp_path / 'a.csv', ['time_s', 'command_mm', 'measured_mm'])
    names, rows = path.read_text().split('\n', 1)
    path.write_text(f'{names}\n{units}\n{rows}')
    with pytest.raises(InputError, match=f'{said}.*mend the one that is wrong'):
        read(path)


def test_units_in_a_file_contradict_its_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As in a line of text: what an attribute says of a dataset; `map` asks."""
    path = tmp_path / 'a.h5'
    columns = {'time_s': TIME, 'command_mm': COMMAND, 'measured_mm': MEASURED}
    with h5py.File(path, 'w') as file:
        for name, values in columns.items():
            file[name] = values
        file['command_mm'].attrs['units'] = 'm'
    with pytest.raises(InputError, match=r"'command_mm' has unit 'mm' in its name.*'m'"):
        read(path)
    main(['map', str(path)])
    assert "CHECK unit: the name says 'mm', and the file gives 'm'" in capsys.readouterr().out


@pytest.mark.parametrize(
    'units',
    [
        's,mm,mm',
        'sec,mm,mm',
        's,mm,',
        '[s],[mm],-',
        's,mm,Millimeter',
        'Seconds,MILLIMETRES,(mm)',
        's,MM,n/a',
        's,none,mm',
        'sec.,mm.,mm',
        'Sec.,mm (abs),mm rel',
        'Sekunden,mm [peak],mm_disp',
        'second(s),mm,Length (mm)',
        'elapsed s,mm,in mm',
        's,mm,n.a.',
        's,mm,EU',
        's,mm,Unit',
        's,mm,unknown unit',
        's,mm,user-defined',
        's,mm,length',
        's,mm,physical',
        's,mm,scaled',
        'Time,mm,furlong',
        'hh:mm:ss,mm,mm',
    ],
)
def test_units_said_twice_alike_are_read(tmp_path: Path, units: str) -> None:
    """Another spelling of a unit, or none, contradicts nothing."""
    path = table(tmp_path / 'a.csv', ['time_s', 'command_mm', 'measured_mm'])
    names, rows = path.read_text().split('\n', 1)
    path.write_text(f'{names}\n{units}\n{rows}')
    np.testing.assert_allclose(read(path).measured, MEASURED * 1e-3, atol=1e-9)


@pytest.mark.parametrize(
    ('written', 'meant'),
    [
        ('Meters', 'm'),
        ('Inches', 'in'),
        ('Kilonewtons', 'kN'),
        ('seconds since 1970-01-01', 's'),
        ('MN', 'MN'),
        ('mN', 'mN'),
        ('--', ''),
        ('furlong', 'furlong'),
        ('Milimeters', 'mm'),
        ('Millimètres', 'mm'),
    ],
)
def test_words_are_units_in_any_capitals_and_symbols_in_their_own(
    written: str, meant: str
) -> None:
    """A word has no other meaning in capitals; `mN` is no meganewton, and is not guessed."""
    assert symbol(written) == meant
    assert contradict('kN', written) == (meant not in ('kN', '', 'furlong'))


@pytest.mark.parametrize(
    ('named', 'stated'),
    [
        ('N', 'N.'),
        ('mm', 'mm, absolute'),
        ('mm', 'displacement'),
        ('mm', 'Displacement'),
        ('mm', 'From Custom Scale'),
        ('mm', 'Custom'),
        ('mm', 'second axis'),
        ('mm', 'Weg / mm'),
        ('mm', 'MM ABS'),
    ],
)
def test_words_that_state_no_other_unit_contradict_nothing(named: str, stated: str) -> None:
    """Remarks, scales of an acquisition, quantities; the unit itself among other words."""
    assert not contradict(named, stated)


@pytest.mark.parametrize('stated', ['Volts', 'INCHES', 'meters', 'Newtons', 'KN', '%', 'counts'])
def test_another_unit_in_any_capitals_contradicts(stated: str) -> None:
    """The same words beside a name in millimetres, alone or with a remark."""
    assert contradict('mm', stated)
    if stated.casefold() != 'kn':
        assert contradict('mm', f'{stated} (raw)')
    assert contradict('N', stated) == (stated != 'Newtons')


@pytest.mark.parametrize('name', ['Force [Kilo Newton]', 'force (kilo newtons)', 'Force [kN]'])
def test_a_unit_of_two_words_in_a_name(name: str) -> None:
    """The column is the force, and not left out without a word."""
    assert recognise(name) == ('force', 'kN')
    assert recognise('Command (of the table)') is None


def test_a_unit_that_a_file_spells_out_holds_where_the_name_has_none(tmp_path: Path) -> None:
    """An attribute `meters` of a dataset `command`."""
    path = tmp_path / 'a.h5'
    columns = {'time': (TIME, 'Seconds'), 'command': (COMMAND, 'Millimeters')}
    columns['measured'] = (1e-3 * MEASURED, 'meters')
    with h5py.File(path, 'w') as file:
        for name, (values, unit) in columns.items():
            file[name] = values
            file[name].attrs['units'] = unit
    record = read(path)
    np.testing.assert_allclose(record.command, COMMAND * 1e-3, atol=1e-9)
    np.testing.assert_allclose(record.measured, MEASURED * 1e-3, atol=1e-9)


def test_a_pipe_parts_columns(tmp_path: Path) -> None:
    """As other delimiters do, with decimal commas, too; `map` sees the same columns."""
    path = table(tmp_path / 'a.csv', ['time_s', 'command_mm', 'measured_mm'], '|')
    for text in (path.read_text(), path.read_text().replace('.', ',')):
        path.write_text(text)
        np.testing.assert_allclose(read(path).measured, MEASURED * 1e-3, atol=1e-9)
        assert [column.label for column in look(path).columns][1:] == ['command_mm', 'measured_mm']


@pytest.mark.parametrize('zone', ['', 'Z', ' UTC', ' GMT', '+0000', '+00:00', ' +00:00'])
def test_zones_of_times(tmp_path: Path, zone: str) -> None:
    """Every way to write one: nothing is said to have no unit."""
    stamps = np.datetime64('2024-10-27T12:00:00', 'ms') + np.arange(COUNT)
    rows = zip(stamps, COMMAND, MEASURED, strict=True)
    path = tmp_path / 'a.csv'
    text = '\n'.join(f'{s}{zone},{c:.6f},{m:.6f}' for s, c, m in rows)
    path.write_text(f'time,command_mm,measured_mm\n{text}\n')
    record = read(path)
    assert (record.period, record.start_ns) == (1e-3, 1_730_030_400 * 10**9)


def test_columns_of_one_matrix_are_told_apart(tmp_path: Path) -> None:
    """A matrix that is called command has two of them: both are named."""
    with h5py.File(tmp_path / 'a.h5', 'w') as file:
        file['time_s'], file['measured_mm'] = TIME, MEASURED
        file['command_mm'] = np.column_stack([COMMAND, COMMAND])
    with pytest.raises(InputError, match=r"'command_mm\(:,1\)' and 'command_mm\(:,2\)'; keep one"):
        read(tmp_path / 'a.h5')


def test_text_that_is_called_mat(tmp_path: Path) -> None:
    """It is not damaged."""
    path = table(tmp_path / 'a.mat', ['time_s', 'command_mm', 'measured_mm'])
    with pytest.raises(InputError, match=r'this is text, not a MATLAB \.mat file; give it a name'):
        read(path)


@pytest.mark.parametrize(
    'other',
    ['command_velocity_mm_s', 'measured_filtered_mm', 'command_mm/s', 'measured_ft', 'time_utc'],
)
@pytest.mark.parametrize('first', [False, True])
def test_beside_a_channel_another_quantity_is_none(
    tmp_path: Path, other: str, first: bool
) -> None:
    """Only the one with a unit that is understood can be meant."""
    names, columns = ['time_s', 'command_mm', 'measured_mm'], [TIME, COMMAND, MEASURED]
    at = 0 if first else 3
    names.insert(at, other)
    columns.insert(at, -TIME)
    path = tmp_path / 'a.csv'
    np.savetxt(path, np.column_stack(columns), '%.6f', ',', header=','.join(names), comments='')
    record = read(path)
    np.testing.assert_allclose(record.command, COMMAND * 1e-3, atol=1e-9)
    np.testing.assert_allclose(record.measured, MEASURED * 1e-3, atol=1e-9)


@pytest.mark.parametrize('other', ['command', 'command_m', 'command_V'])
def test_two_that_may_be_the_channel_are_refused(tmp_path: Path, other: str) -> None:
    path = table(tmp_path / 'a.csv', ['time_s', 'command_mm', other])
    with pytest.raises(InputError, match='two columns are called command'):
        read(path)


@pytest.mark.parametrize('unit', ['Kips', 'KIP', 'Lbf', 'kip', 'kips', 'lb', 'Lbs'])
def test_units_of_force_in_any_capitals(unit: str) -> None:
    """They can mean nothing else."""
    assert ROLES['force'][symbol(unit)] > 4.0


def test_the_torque_of_an_angle_is_proposed_as_one(tmp_path: Path) -> None:
    """The proposed map said kN."""
    path, out = tmp_path / 'a.csv', tmp_path / 'map.yaml'
    table(path, ['time_s', 'command_deg', 'measured_deg'])
    rows = [f'{line},{line.rpartition(",")[2]}' for line in path.read_text().splitlines()[1:]]
    path.write_text('\n'.join(['time_s,command_deg,measured_deg,force_Nm', *rows]))
    assert main(['map', str(path), '--out', str(out)]) == 0
    np.testing.assert_allclose(read(path, channels=out).force, MEASURED, atol=1e-6)


@pytest.mark.parametrize(
    ('stroke', 'message', 'unit'),
    [
        (8e-3, False, 'm'),
        (8.0, False, 'mm'),
        (0.3, True, 'm'),
        (80.0, True, 'mm'),
    ],
)
def test_the_likeliest_unit_is_that_of_the_stroke(stroke: float, message: bool, unit: str) -> None:
    """8 mm in metres were 8 um; messages of ROS are in metres where they can be. It is asked."""
    times = TIME if message else None
    columns = [
        ColumnLook('command', 'command', '', stroke / 6.0 * COMMAND, times),
        ColumnLook('measured', 'measured', '', stroke / 6.0 * MEASURED, times),
    ]
    found = propose(FileLook(Path('a'), columns, {}, 1e-3, 'made up'))
    for role in ('command', 'measured'):
        assert found.channels[role].unit == unit
        assert 'the file states none' in found.channels[role].unsure[0]


def test_the_likeliest_unit_is_one_for_both() -> None:
    """A command of 50 mm and back was in mm, and what followed it almost as far in m."""
    columns = [
        ColumnLook(name, name, '', values * 0.1 / float(np.ptp(COMMAND)))
        for name, values in (('command', COMMAND), ('measured', 0.98 * MEASURED))
    ]
    found = propose(FileLook(Path('a'), columns, {}, 1e-3, 'made up'))
    assert {found.channels[role].unit for role in ('command', 'measured')} == {'mm'}
