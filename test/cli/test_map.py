"""`actuator-glue map`: what an unknown file holds, and a channel map that reads it."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import savemat

from actuator_glue.cli.main import main
from actuator_glue.io.channel_map import parse_channel_map
from actuator_glue.io.load import load_records

RATE, COUNT = 512.0, 4000
TIME = np.arange(COUNT) / RATE


def channels(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return command [mm], what is measured 8 samples later with noise, and a force [kN]."""
    rng = np.random.default_rng(seed)
    command = np.convolve(rng.standard_normal(COUNT + 99), np.ones(100) / 10.0, 'valid')
    measured = 0.97 * np.roll(command, 8) + 0.01 * rng.standard_normal(COUNT)
    measured[:8] = 0.0
    return command, measured, 3.0 * measured + 0.5 * rng.standard_normal(COUNT)


def looked(tmp_path: Path, path: Path, *options: str, code: int = 0) -> dict:
    """Run `map` and return its JSON."""
    out = tmp_path / 'map.json'
    assert main(['map', str(path), '--json', str(out), '--force', *options]) == code
    found: dict = json.loads(out.read_text())
    assert found['schema'] == 'actuator_glue.map/1'
    return found


def write(path: Path, head: str, columns: list[np.ndarray], delimiter: str = ',') -> Path:
    """Write a text with some lines above its numbers."""
    rows = [delimiter.join(f'{v:.6f}' for v in row) for row in np.column_stack(columns)]
    path.write_text('\n'.join([head, *rows]) + '\n', encoding='utf-8')
    return path


@pytest.mark.parametrize(('unit', 'seconds'), [('h', 3600.0), ('min', 60.0), ('ms', 1e-3)])
def test_the_unit_in_the_name_of_a_clock_is_taken(
    tmp_path: Path, unit: str, seconds: float
) -> None:
    """Of `time_h` a map said seconds, though the file was read without one."""
    columns = [TIME / seconds, *channels()[:2]]
    rows = [','.join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    path = tmp_path / 'a.csv'
    path.write_text('\n'.join([f'time_{unit},command_mm,measured_mm', *rows]) + '\n')
    assert looked(tmp_path, path)['channels']['time']['unit'] == unit


def test_a_rate_that_the_clock_contradicts_is_no_answer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file needs no map, and the one with this rate would be refused: it is said, code 1."""
    command, measured, _ = channels()
    path = write(tmp_path / 'a.csv', 'time_s,command_mm,measured_mm', [TIME, command, measured])
    found = looked(tmp_path, path, '--rate', '256', code=1)
    assert (found['needed'], found['works']) == (False, False)
    assert 'with this map the file is refused' in capsys.readouterr().err
    assert 'said to be 256 Hz, but by its column of times it is 512 Hz' in found['problem']
    assert looked(tmp_path, path)['works']


def test_an_empty_file_is_called_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / 'a.csv').write_text('\n\n')
    assert main(['map', str(tmp_path / 'a.csv')]) == 2
    assert 'a.csv: the file is empty' in capsys.readouterr().err


def test_several_forces_are_shown_and_none_is_guessed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing was said of them; a line of the map that is uncommented takes one."""
    command, measured, force = channels()
    columns = [TIME, command, measured, force, 2.0 * force]
    head = 'time_s,command_mm,measured_mm,Load cell 1 (kN),Load cell 2 (kN)'
    path, out = write(tmp_path / 'a.csv', head, columns), tmp_path / 'map.yaml'
    found = looked(tmp_path, path, '--out', str(out))
    assert [guess['column'] for guess in found['forces']] == head.split(',')[3:]
    assert 'is read as it is, without a force' in capsys.readouterr().out
    text = out.read_text()
    assert '#   CHECK force: none of these is taken' in text
    assert load_records(path, channels=out)[0].force is None
    out.write_text(text.replace('# force: {column: "Load cell 2', 'force: {column: "Load cell 2'))
    (record,) = load_records(path, channels=out)
    assert record.force is not None
    np.testing.assert_allclose(record.force, 2e3 * force, atol=1e-2)


@pytest.mark.parametrize(
    ('names', 'taken'),
    [
        ('Force (kN),Force rate (kN/s)', 'Force (kN)'),
        ('force_N,Load cell 1 (kN)', 'force_N'),
        ('Load cell (kN),Load mode', 'Load cell (kN)'),
    ],
)
def test_one_force_among_others_is_taken(tmp_path: Path, names: str, taken: str) -> None:
    command, measured, force = channels()
    head = f'time_s,command_mm,measured_mm,{names}'
    path = write(tmp_path / 'a.csv', head, [TIME, command, measured, force, 2.0 * force])
    found = looked(tmp_path, path)
    assert (found['channels']['force']['column'], found['forces']) == (taken, [])


@pytest.mark.parametrize('order', ['ucf', 'ufc', 'fuc'])
def test_a_force_that_follows_is_not_measured(tmp_path: Path, order: str) -> None:
    """A spring moves with the piston; without names the stroke tells them apart."""
    command, measured, _ = channels()
    columns = {'u': command, 'c': measured, 'f': 2400.0 * measured}
    path = write(tmp_path / 'a.txt', 'a,b,c,d', [TIME, *(columns[name] for name in order)])
    found = looked(tmp_path, path)
    names = dict(zip(order, 'bcd', strict=True))
    chosen = {role: found['channels'][role]['column'] for role in ('command', 'measured')}
    assert chosen == {'command': names['u'], 'measured': names['c']}


@pytest.mark.parametrize('seed', range(4))
def test_channels_without_names_are_told_by_what_they_do(tmp_path: Path, seed: int) -> None:
    """The one that follows is measured; the proposal reads the file; a force is not guessed."""
    command, measured, force = channels(seed)
    nothing = np.full(COUNT, 7.0)
    columns = [np.arange(COUNT), measured, nothing, command, force]
    path = write(tmp_path / 'a.txt', 'Logger 3\nsome; remark\n\nN;A;B;C;D', columns, ';')
    found = looked(tmp_path, path, '--rate', '512')
    assert found['channels']['command']['column'] == 'C'
    assert found['channels']['measured']['column'] == 'A'
    assert '15.6 ms' in found['channels']['measured']['reasons'][0]
    assert 'force' not in found['channels']
    assert any('unit' in line for line in found['channels']['command']['check'])
    described = yaml.safe_load(found['map'])
    assert (described['header_lines'], described['sample_number']) == (4, 'N')
    (record,) = load_records(path, channels=parse_channel_map(described, 'map'))
    np.testing.assert_allclose(record.command, command * 1e-3, atol=1e-9)
    assert record.rate == 512.0
    missing = looked(tmp_path, path, code=1)
    assert '--rate' in missing['problem']
    assert missing['map'] is None


def test_names_units_and_times_are_used(tmp_path: Path) -> None:
    """Words of controllers in two languages, a line of units, a clock in ms."""
    command, measured, force = channels()
    head = 'Zeit,Sollwert,Istwert,Kraft\nms,mm,mm,kN'
    path = write(tmp_path / 'a.csv', head, [1e3 * TIME, command, measured, force])
    out = tmp_path / 'map.yaml'
    found = looked(tmp_path, path, '--out', str(out))
    (record,) = load_records(path, channels=out)
    np.testing.assert_allclose(record.command, command * 1e-3, atol=1e-9)
    assert record.force is not None
    np.testing.assert_allclose(record.force, force * 1e3, atol=1e-2)
    assert record.rate == pytest.approx(RATE, rel=1e-6)
    assert all(not channel['check'] for channel in found['channels'].values())
    ranges = {c['column']: (c['least'], c['greatest']) for c in found['columns']}
    assert ranges['Istwert'] == pytest.approx((measured.min(), measured.max()), abs=1e-6)


def test_inches_with_a_point_are_inches(tmp_path: Path) -> None:
    """As a word or an abbreviation a unit that is known needs no scale and no second look."""
    command, measured, _ = channels()
    head = 'Time (seconds),Cmd (in.),Disp (Inches)'
    path = write(tmp_path / 'a.csv', head, [TIME, command / 25.4, measured / 25.4])
    found = looked(tmp_path, path, '--out', str(tmp_path / 'map.yaml'))
    assert all(not channel['check'] for channel in found['channels'].values())
    (record,) = load_records(path, channels=tmp_path / 'map.yaml')
    np.testing.assert_allclose(record.command, command * 1e-3, atol=1e-7)


def test_a_second_column_of_times_is_told(tmp_path: Path) -> None:
    """Each channel may have its own: the first one alone would leave the other shifted."""
    command, measured, _ = channels()
    head = 'Time 1 [s],Command [mm],Time 2 [s],Position [mm]'
    path = write(tmp_path / 'a.csv', head, [TIME, command, TIME + 0.0105, measured])
    (told,) = looked(tmp_path, path)['channels']['time']['check']
    assert 'Time 2 [s] may be it as well' in told


@pytest.mark.parametrize(
    ('name', 'factor', 'first'),
    [('Elapsed [s]', 1.0, 0.0), ('Time [ms]', 1e3, 0.0), ('Epoch time [s]', 1.0, 1.7e9)],
)
def test_one_clock_written_twice_is_no_second_one(
    tmp_path: Path, name: str, factor: float, first: float
) -> None:
    command, measured, _ = channels()
    head = f'Time [s],Command [mm],{name},Position [mm]'
    path = write(tmp_path / 'a.csv', head, [TIME, command, first + factor * TIME, measured])
    assert not looked(tmp_path, path)['channels']['time']['check']


@pytest.mark.parametrize('first', [45_415.0, 739_375.25])
def test_days_are_proposed_as_such(tmp_path: Path, first: float) -> None:
    """A spreadsheet counts them since 1900, MATLAB since year 0; never a rate in place of them."""
    command, measured, _ = channels()
    rows = zip(first + TIME / 86_400.0, command, measured, strict=True)
    text = '\n'.join(f'{t:.12f},{u:.6f},{x:.6f}' for t, u, x in rows)
    (tmp_path / 'days.csv').write_text(f'time,command_mm,measured_mm\n{text}\n')
    found = looked(tmp_path, tmp_path / 'days.csv', '--out', str(tmp_path / 'map.yaml'))
    assert found['channels']['time']['scale'] == 86_400.0
    described = parse_channel_map(yaml.safe_load((tmp_path / 'map.yaml').read_text()), 'map')
    (record,) = load_records(tmp_path / 'days.csv', channels=described)
    assert record.rate == pytest.approx(RATE, rel=1e-5)
    np.testing.assert_allclose(record.command, 1e-3 * np.round(command, 6), atol=1e-12)


def test_a_turned_channel_and_a_matrix(tmp_path: Path) -> None:
    """A measurement of opposite sign gets a scale of -1 and a word; columns of a .mat."""
    command, measured, _ = channels()
    savemat(tmp_path / 'a.mat', {'run': {'data': np.column_stack([TIME, command, -measured])}})
    found = looked(tmp_path, tmp_path / 'a.mat')
    assert found['channels']['measured']['column'] == 'run.data(:,3)'
    assert found['channels']['measured']['scale'] == -1.0
    assert any('sign' in line for line in found['channels']['measured']['check'])
    assert found['works']


def test_a_bag_of_other_topics(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its topics with their rates; the proposal reads it."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    command, measured, _ = channels()
    store = get_typestore(Stores.ROS2_JAZZY)
    kind = 'std_msgs/msg/Float64'
    with Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = [writer.add_connection(n, kind, typestore=store) for n in ('/a/x', '/b')]
        for i in range(COUNT):
            for topic, values in zip(topics, (measured, command), strict=True):
                data = store.serialize_cdr(store.types[kind](values[i]), kind)
                writer.write(topic, 10**18 + round(i * 1e9 / RATE), data)
    found = looked(tmp_path, tmp_path / 'bag')
    assert found['channels']['command']['column'] == '/b'
    assert found['columns'][0]['rate_hz'] == pytest.approx(RATE)
    (record,) = load_records(
        tmp_path / 'bag', channels=parse_channel_map(yaml.safe_load(found['map']), 'map')
    )
    np.testing.assert_allclose(record.measured, measured * 1e-3, rtol=1e-12)
    assert 'messages/s' in capsys.readouterr().out


def test_a_labview_measurement_file(tmp_path: Path) -> None:
    """Header of a .lvm with its marks, blanks where there is no comment."""
    command, measured, _ = channels()
    head = 'LabVIEW Measurement\t\nSeparator\tTab\nDate\t2026/05/01\n***End_of_Header***\t\n\t\n'
    head += 'Channels\t2\t\t\nSamples\t4000\t4000\t\n***End_of_Header***\t\t\t\n'
    head += 'X_Value\tTarget\tActual\tComment'
    path = write(tmp_path / 'a.lvm', head, [TIME, command, measured], '\t')
    found = looked(tmp_path, path)
    assert found['channels']['command']['column'] == 'Target'
    (record,) = load_records(path, channels=parse_channel_map(yaml.safe_load(found['map']), 'map'))
    np.testing.assert_allclose(record.measured, measured * 1e-3, atol=1e-9)


@pytest.mark.parametrize('suffix', ['.h5', '.parquet', '.tdms', '.xlsx'])
def test_formats_with_columns_of_other_names(tmp_path: Path, suffix: str) -> None:
    """Every format is looked at, and read through what is proposed."""
    command, measured, force = channels()
    named = {'Time': TIME, 'Setpoint': command, 'LVDT': measured, 'Load': force}
    path = tmp_path / f'a{suffix}'
    if suffix == '.h5':
        import h5py

        with h5py.File(path, 'w') as file:
            for name, values in named.items():
                file[f'run/{name}'] = values
    elif suffix == '.parquet':
        import pyarrow as pa
        import pyarrow.parquet as pq

        pq.write_table(pa.table(named), path)
    elif suffix == '.tdms':
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(path) as writer:
            writer.write_segment([ChannelObject('run', n, v) for n, v in named.items()])
    else:
        import openpyxl

        book = openpyxl.Workbook()
        book.active.append(list(named))
        for row in np.column_stack(list(named.values())).tolist():
            book.active.append(row)
        book.save(path)
    found = looked(tmp_path, path)
    roles = {role: str(g['column']).rpartition('/')[2] for role, g in found['channels'].items()}
    assert roles == {'time': 'Time', 'command': 'Setpoint', 'measured': 'LVDT', 'force': 'Load'}
    (record,) = load_records(path, channels=parse_channel_map(yaml.safe_load(found['map']), 'map'))
    np.testing.assert_allclose(record.command, command * 1e-3, rtol=1e-12)


def test_a_file_that_needs_no_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is told so, and nothing is asked of the reader."""
    command, measured, _ = channels()
    head = 'time_s,command_mm,measured_mm'
    path = write(tmp_path / 'a.csv', head, [TIME, command, measured])
    assert not looked(tmp_path, path)['needed']
    assert 'needs no channel map' in capsys.readouterr().out


def test_nothing_alike_is_no_proposal(tmp_path: Path) -> None:
    """Channels that have nothing to do with each other: exit code 1, no map written."""
    noise = np.random.default_rng(0).standard_normal((2, COUNT))
    path = write(tmp_path / 'a.csv', 't,p,q', [TIME, *noise])
    found = looked(tmp_path, path, '--out', str(tmp_path / 'map.yaml'), code=1)
    assert found['map'] is None
    assert not (tmp_path / 'map.yaml').exists()


def test_info_shows_the_unit_that_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """People read inches or micrometres; JSON stays in m."""
    path = write(tmp_path / 'a.csv', 'time_s,command_mm,measured_mm', [TIME, 25.4 * TIME, TIME])
    for unit, greatest in (('in', '7.8105'), ('mm', '198.39'), ('m', '0.19839')):
        assert main(['info', str(path), '--unit', unit, '--json', '-']) == 0
        shown = capsys.readouterr()
        assert f'{greatest} {unit}' in shown.err
        assert json.loads(shown.out)['files'][0]['records'][0]['command_m'][1] > 0.19
