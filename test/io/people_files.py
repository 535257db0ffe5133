"""Ten files as people bring them, made from one simulated test, and what each gives.

`python test/io/people_files.py` writes the table of docs/what_people_bring.md;
test_what_people_bring.py asks every row for the values of the test.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from matio import save_to_mat
from matio.utils.matclass import MatlabOpaque
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

import actuator_glue as ag
from actuator_glue.cli.main import main
from actuator_glue.records import Record

PAGE = Path(__file__).resolve().parents[2] / 'docs' / 'what_people_bring.md'
MARK = '<!-- The table below is written by test/io/people_files.py -->\n'
RATE, SECONDS = 250.0, 20.0
CUT = 175  # samples by which a second file begins later
OFFSET = 3.2174  # s by which its clock is ahead


@cache
def test() -> Record:
    """Return the test that all files hold: a free actuator, a sweep of 2 mm to 5 Hz."""
    return ag.simulate(ag.Command(rate=RATE, duration=SECONDS, high=5.0), stiffness=0.0, seed=11)


def at(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return command and measured displacement at other times [mm], without new noise."""
    record = test()
    channels = (record.command, record.measured)
    command, measured = (1e3 * np.interp(time, record.time, c) for c in channels)
    return command, measured


def columns() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times [s], command and measured displacement [mm]."""
    record = test()
    return record.time, 1e3 * record.command, 1e3 * record.measured


def text(path: Path, head: list[str], rows: np.ndarray, by: str = ',', end: str = '\n') -> None:
    """Write lines and rows."""
    lines = [*head, *(by.join(f'{v:.9g}' for v in row) for row in rows)]
    path.write_text(end.join(lines) + end, encoding='utf-8', newline='')


def jittered(folder: Path) -> None:
    """Write a log of a controller, a sample every 20 to 55 ms."""
    time = np.cumsum(np.random.default_rng(1).uniform(20e-3, 55e-3, 500))
    time = time[time < test().time[-1]]
    text(folder / 'log.csv', ['time_s,command_mm,measured_mm'], np.column_stack([time, *at(time)]))


def whole_seconds(folder: Path) -> None:
    """Write a data logger's file: times of day in whole seconds, 250 rows of each."""
    time, command, measured = columns()
    stamps = [f'12:{int(t) // 60:02d}:{int(t) % 60:02d}' for t in time + 0.3]
    lines = ['Time;Command [mm];Measured [mm]']
    rows = zip(stamps, command, measured, strict=True)
    lines += [f'{t};{u:.6f};{x:.6f}'.replace('.', ',') for t, u, x in rows]
    (folder / 'logger.csv').write_text('\n'.join(lines) + '\n', encoding='utf-8')


def control_desk(folder: Path) -> None:
    """Write what ControlDesk exports: structs X and Y(1..2) with Name, Unit and Data."""
    time, command, measured = columns()
    signals = np.empty((1, 2), dtype=[(n, object) for n in ('Name', 'Unit', 'Data')])
    for i, (name, values) in enumerate((('Target position', command), ('Piston', measured))):
        signals[0, i] = (name, 'mm', values.reshape(1, -1))
    clock = np.empty((1, 1), dtype=[(n, object) for n in ('Name', 'Unit', 'Data')])
    clock[0, 0] = ('Time', 's', time.reshape(1, -1))
    run = np.empty((1, 1), dtype=[('X', object), ('Y', object)])
    run[0, 0] = (clock, signals)
    with warnings.catch_warnings(action='ignore'):
        save_to_mat(str(folder / 'desk.mat'), {'run_7': run}, version='v7.3')


def simulink(folder: Path) -> None:
    """Write what Simulink logs: a Dataset of two signals with a timeseries each."""
    _, command, measured = columns()
    signals = np.empty((2, 1), dtype=object)
    for i, (name, values) in enumerate((('command', command), ('measured', measured))):
        info = {
            'Units': 'seconds',
            'Start_': np.zeros((1, 1)),
            'Increment_': np.full((1, 1), 1.0 / RATE),
        }
        info['Length'] = np.full((1, 1), float(len(values)))
        series = {
            'Name': name,
            'Data_': values.reshape(-1, 1),
            'Time_': np.zeros((0, 0)),
            'TimeInfo': MatlabOpaque(info, 'tsdata.timemetadata'),
            'DataInfo': MatlabOpaque({'Units': 'mm'}, 'tsdata.datametadata'),
        }
        said = {'Name': name, 'Values': MatlabOpaque(series, 'timeseries')}
        signals[i, 0] = MatlabOpaque(said, 'Simulink.SimulationData.Signal')
    storage = 'Simulink.SimulationData.Storage.RamDatasetStorage'
    held = {'Name': 'logsout', 'Storage_': MatlabOpaque({'Elements': signals}, storage)}
    logged = MatlabOpaque(held, 'Simulink.SimulationData.Dataset')
    with warnings.catch_warnings(action='ignore'):
        save_to_mat(str(folder / 'logsout.mat'), {'logsout': logged}, version='v7.3')


def mts(folder: Path) -> None:
    """Write a file of MTS MPT: three blocks, each below a line, names and units of its own."""
    table = np.column_stack(columns())
    lines = ['MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A', '']
    for part in np.split(table, [300, 4300]):
        lines.append(f'Data Acquisition: Timed\t\t\tTime:\t{part[0, 0]:.4f}\tSec')
        lines += ['Running Time\tAxial Command\tAxial Displacement', 'Sec\tmm\tmm']
        lines += ['\t'.join(f'{v:.9g}' for v in row) for row in part] + ['']
    (folder / 'specimen.dat').write_text('\r\n'.join(lines), encoding='utf-8', newline='')


def labview(folder: Path) -> None:
    """Write a LabVIEW .lvm that was appended to: a heading for each thousand samples."""
    _, command, measured = columns()
    lines = ['LabVIEW Measurement', 'Separator\tTab', 'Decimal_Separator\t.', 'X_Columns\tNo']
    lines += ['Multi_Headings\tYes', '***End_of_Header***', '']
    for first in range(0, len(command), 1000):
        part = slice(first, first + 1000)
        clock = f'10:00:{first / RATE:013.10f}'
        lines += ['Channels\t2', 'Date\t2024/05/03\t2024/05/03', f'Time\t{clock}\t{clock}']
        lines += ['Y_Unit_Label\tmm\tmm', 'X0\t0\t0', f'Delta_X\t{1 / RATE}\t{1 / RATE}']
        lines += ['***End_of_Header***', 'X_Value\tCommand\tMeasured\tComment']
        rows = zip(command[part], measured[part], strict=True)
        lines += [*(f'\t{u:.6f}\t{x:.6f}' for u, x in rows), '']
    (folder / 'test.lvm').write_text('\r\n'.join(lines), encoding='cp1252', newline='')


def two_files(folder: Path) -> None:
    """Write the command as one program logs it, and the response as another, with its clock."""
    time, command, measured = columns()
    text(folder / 'cmd.csv', ['time_s,command_mm'], np.column_stack([time, command]))
    rows = np.column_stack([time[CUT:] + OFFSET, measured[CUT:]])
    text(folder / 'daq.csv', ['time_s,measured_mm'], rows)


def rotary(folder: Path) -> None:
    """Write a file of a rotary actuator in degrees."""
    time, command, measured = columns()
    rows = np.column_stack([time, 10.0 * command, 10.0 * measured])
    head = 'Zeit [s]\tSollwinkel [deg]\tIstwinkel [deg]'
    text(folder / 'drehantrieb.txt', [head], rows, '\t', '\r\n')


def velocity(folder: Path) -> None:
    """Write a drive that is told velocities."""
    time, command, _ = columns()
    noise = 0.01 * np.random.default_rng(2).standard_normal(len(time))
    rows = np.column_stack([time, 10.0 * command, np.cumsum(10.0 * command) / RATE + noise])
    text(folder / 'drive.csv', ['time_s,cmd,pos'], rows)


def ros_1(folder: Path) -> None:
    """Write a bag of ROS 1."""
    store = get_typestore(Stores.ROS1_NOETIC)
    number = store.types['std_msgs/msg/Float64']
    with Writer(folder / 'old.bag') as bag:
        topics = {
            name: bag.add_connection(name, 'std_msgs/msg/Float64', typestore=store)
            for name in ('/command', '/position')
        }
        for stamp, *pair in zip(*columns(), strict=True):
            for topic, value in zip(topics.values(), pair, strict=True):
                data = store.serialize_ros1(number(data=float(value)), 'std_msgs/msg/Float64')
                bag.write(topic, 1_700_000_000_000_000_000 + round(stamp * 1e9), data)


@dataclass(frozen=True, slots=True)
class Row:
    """One row of the table.

    Attributes:
        brought: what people bring.
        make: write its files into a folder.
        commands: what is typed, the last one writes test.csv where a record is read.
        first: exit code and what the first command says, where it is refused.
        per_mm: of the unit in which the record is, how many are one mm of the test [1].
        within: root mean square by which the record may be off the test [m].
        says: what must be told besides.
    """

    brought: str
    make: Callable[[Path], None]
    commands: tuple[str, ...]
    first: str = ''
    per_mm: float = 1.0
    within: float = 1e-9
    says: str = ''


ROWS = (
    Row(
        'log of a controller, a sample every 20 to 55 ms',
        jittered,
        ('info log.csv', 'convert log.csv test.csv --resample 27'),
        first='the clock is jittered, its steps are 20 to 55 ms',
        within=2e-5,
        says='above 7.6 Hz more than 5 % of an amplitude is lost',
    ),
    Row(
        'data logger: times of day in whole seconds, 250 rows of each, decimal commas',
        whole_seconds,
        ('info logger.csv', 'convert logger.csv test.csv --resample 250'),
        first='time stands still',
        says='an even clock was taken in place of them',
    ),
    Row(
        'ControlDesk: MATLAB 7.3, structs X and Y(1) to Y(2)',
        control_desk,
        ('map desk.mat --out map.yaml', 'convert desk.mat test.csv --channels map.yaml'),
        says='called',  # a map gives its reasons
    ),
    Row(
        'Simulink: a Dataset of signals (logsout)',
        simulink,
        ('convert logsout.mat test.csv',),
    ),
    Row(
        'MTS MPT: three blocks of samples, each below names and units',
        mts,
        ('map specimen.dat --out map.yaml', 'convert specimen.dat test.csv --channels map.yaml'),
        says='CHECK block: the longest of 3 is taken',
    ),
    Row(
        'LabVIEW .lvm that was appended to: a heading for each thousand samples',
        labview,
        ('convert test.lvm test.csv',),
    ),
    Row(
        'two files: the command of one program, the response of another with its own clock',
        two_files,
        ('convert cmd.csv daq.csv test.csv --join correlation',),
        within=1.5e-4,  # three of the standard deviations that are told
        says='a delay would be taken for a difference of the clocks',
    ),
    Row(
        'rotary actuator in degrees, German names',
        rotary,
        (
            'map drehantrieb.txt --out map.yaml',
            'convert drehantrieb.txt test.csv --channels map.yaml',
        ),
        per_mm=10.0,
        says='in deg, which is kept',
    ),
    Row(
        'drive that is told velocities',
        velocity,
        ('map drive.csv',),
        first='A displacement command is needed',
    ),
    Row(
        'bag of ROS 1',
        ros_1,
        ('info old.bag',),
        first='`rosbags-convert --src OLD --dst NEW --dst-storage mcap` makes one',
    ),
)


@dataclass(frozen=True, slots=True)
class Given:
    """What a row gave: exit codes, all that was printed, the record."""

    codes: tuple[int, ...]
    told: str
    record: Record | None


def given(row: Row, folder: Path) -> Given:
    """Make the files of a row in a folder, and type its commands there."""
    row.make(folder)
    codes, said = [], io.StringIO()
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(said),
    ):
        codes = [main(command.split()) for command in row.commands]
        record = ag.load('test.csv') if Path('test.csv').exists() else None
    return Given(tuple(codes), said.getvalue(), record)


def off(row: Row, record: Record) -> tuple[float, float]:
    """Return by how much command and measured are off the test [m], root mean squares."""
    truth = test()
    time = record.time
    if row.make is two_files:
        time = time + CUT / RATE
    elif row.make is mts:
        time = time + 300 / RATE
    elif row.make is jittered:
        time = time + np.random.default_rng(1).uniform(20e-3, 55e-3, 1)
    pairs = ((record.command, truth.command), (record.measured, truth.measured))
    found = [
        np.sqrt(np.mean((own / row.per_mm - np.interp(time, truth.time, of)) ** 2))
        for own, of in pairs
    ]
    return float(found[0]), float(found[1])


def gives(row: Row, found: Given) -> str:
    """Return what a row gave, for the table."""
    parts = [f'refused: "{row.first}"' if row.first else '']
    if found.record is not None:
        record = found.record
        unit = '' if record.motion == 'm' else f' in {record.motion}'
        error = 1e6 * max(off(row, record))
        exact = 'as simulated' if error < 1e-2 else f'within {error:.2g} um rms of the simulated'
        parts.append(f'{len(record)} samples at {record.rate:g} Hz{unit}, {exact}')
    if row.says and row.says != 'called':
        parts.append(f'told: "{row.says}"')
    return '; '.join(part for part in parts if part)


def table() -> str:
    """Return the table, every row of it made anew."""
    lines = ['| brought | typed | given |', '|---|---|---|']
    for row in ROWS:
        with tempfile.TemporaryDirectory() as folder:
            found = given(row, Path(folder))
        typed = '<br>'.join(f'`{command}`' for command in row.commands)
        lines.append(f'| {row.brought} | {typed} | {gives(row, found)} |')
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    head = PAGE.read_text('utf-8').partition(MARK)[0]
    PAGE.write_text(f'{head}{MARK}\n{table()}', encoding='utf-8')
