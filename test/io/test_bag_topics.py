"""Bags of other people's topics: written with rosbags, read through a channel map."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap, parse_channel_map
from actuator_glue.io.load import load_records
from actuator_glue.records import Record

START = 1_700_000_000_000_000_000
COUNT = 2000
TIME = np.arange(COUNT) * 1e-3
COMMAND = np.round(np.sin(20 * TIME), 6)  # mm
MEASURED = np.sin(20 * TIME - 0.3)  # mm
STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg('float32 load\nstd_msgs/Header header\n', 'lab_msgs/msg/Cell'))
TYPES = STORE.types


def ns(times: np.ndarray) -> np.ndarray:
    """Return stamps [ns]."""
    return START + np.round(times * 1e9).astype(np.int64)


def header(stamp: int) -> Any:
    """Return a std_msgs/Header."""
    stamped = TYPES['builtin_interfaces/msg/Time'](*divmod(int(stamp), 10**9))
    return TYPES['std_msgs/msg/Header'](stamp=stamped, frame_id='x')


def float64(value: float, _: int) -> Any:
    """Return a std_msgs/Float64."""
    return TYPES['std_msgs/msg/Float64'](value)


def joint(value: float, stamp: int) -> Any:
    """Return a sensor_msgs/JointState whose second joint is what is measured."""
    position, empty = np.array([9.0, value]), np.empty(0)
    return TYPES['sensor_msgs/msg/JointState'](header(stamp), ['a', 'b'], position, empty, empty)


def cell(value: float, stamp: int) -> Any:
    """Return a message of a type that no ROS installation knows."""
    return TYPES['lab_msgs/msg/Cell'](value, header(stamp))


Topic = tuple[str, str, Callable[[float, int], Any], np.ndarray, np.ndarray, np.ndarray]


def bag(path: Path, *topics: Topic) -> Path:
    """Write topics of (name, type, message, values, times acquired, times logged)."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        rows = []
        for name, kind, make, values, acquired, logged in topics:
            connection = writer.add_connection(name, kind, typestore=STORE)
            for value, stamp, log in zip(values, ns(acquired), ns(logged), strict=True):
                data = STORE.serialize_cdr(make(float(value), int(stamp)), kind)
                rows.append((int(log), connection, data))
        for log, connection, data in sorted(rows, key=lambda row: row[0]):
            writer.write(connection, log, data)
    return path


def mapped(command: str, measured: str, **more: object) -> ChannelMap:
    """Return a channel map in mm."""
    roles = {'command': command, 'measured': measured}
    channels = {role: {'column': name, 'unit': 'mm'} for role, name in roles.items()}
    return parse_channel_map({**channels, **more}, 'map')


def read(path: Path, channels: ChannelMap, **options: Any) -> list[Record]:
    """Return the records of a bag; what is warned of is an error unless it is asked for."""
    options.setdefault('warn', pytest.fail)
    return load_records(path, channels=channels, **options)


def test_stamped_topics_are_taken_sample_by_sample(tmp_path: Path) -> None:
    """Headers of acquisition win over a recorder's times; arrays, own types, stiffness."""
    late = TIME + np.random.default_rng(0).uniform(0.01, 0.03, COUNT)
    path = bag(
        tmp_path / 'bag',
        ('/target', 'lab_msgs/msg/Cell', cell, COMMAND, TIME, late),
        ('/joints', 'sensor_msgs/msg/JointState', joint, MEASURED, TIME, late),
    )
    force = {'column': '/target.load', 'unit': 'kN'}
    channels = mapped('/target', '/joints.position[1]', force=force, stiffness=5.0)
    (record,) = read(path, channels)
    np.testing.assert_array_equal(record.command, np.float32(COMMAND).astype(float) * 1e-3)
    np.testing.assert_array_equal(record.measured, MEASURED * 1e-3)
    assert record.force is not None
    assert (record.period, record.start_ns, record.stiffness) == (1e-3, START, 5.0)


def test_topics_without_stamps_of_their_own(tmp_path: Path) -> None:
    """std_msgs/Float64 by the times of publication: jitter stays out, phase is kept."""
    rng = np.random.default_rng(1)
    jitter = rng.uniform(-2e-4, 2e-4, (2, COUNT))
    path = bag(
        tmp_path / 'bag',
        ('/command', 'std_msgs/msg/Float64', float64, COMMAND, TIME, TIME + jitter[0]),
        ('/imu/x', 'std_msgs/msg/Float64', float64, MEASURED, TIME, TIME + 3e-4 + jitter[1]),
    )
    told: list[str] = []
    (record,) = read(path, mapped('/command', '/imu/x'), warn=told.append)
    assert record.period == 1e-3
    at = (record.start_ns - START) * 1e-9 + record.time
    # Every command sample once, in order; what is measured where it was 0.3 ms earlier.
    first = round(at[0] / 1e-3)
    assert len(record) >= COUNT - 3
    np.testing.assert_array_equal(record.command, COMMAND[first:][: len(record)] * 1e-3)
    expected = np.sin(20 * (at - 3e-4) - 0.3) * 1e-3
    assert np.abs(record.measured - expected).max() < 20 * 2.5e-4 * 1e-3
    assert any('measured is interpolated' in line for line in told)


def test_a_slow_command_is_held(tmp_path: Path) -> None:
    """A command at 100 Hz beside 1 kHz: ten samples each."""
    few = slice(None, None, 10)
    path = bag(
        tmp_path / 'bag',
        ('/u', 'lab_msgs/msg/Cell', cell, COMMAND[few], TIME[few], TIME[few]),
        ('/x', 'lab_msgs/msg/Cell', cell, MEASURED, TIME, TIME),
    )
    (record,) = read(path, mapped('/u.load', '/x.load'), warn=lambda _: None)
    assert record.period == 1e-3
    held = np.repeat(np.float32(COMMAND[few]).astype(float), 10)[: len(record)]
    np.testing.assert_allclose(record.command, held * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(
        record.measured, np.float32(MEASURED).astype(float)[: len(record)] * 1e-3, atol=1e-18
    )


@pytest.mark.parametrize('missing', [1, 40])
@pytest.mark.parametrize('jitter', [0.0, 2e-4])
def test_missing_messages_are_a_gap(tmp_path: Path, missing: int, jitter: float) -> None:
    """One is missed as forty are; nothing is made up; with --split the stretches are read."""
    times = TIME + np.random.default_rng(2).uniform(-jitter, jitter, COUNT)
    kept = np.delete(np.arange(COUNT), np.arange(700, 700 + missing))
    path = bag(
        tmp_path / 'bag',
        ('/u', 'std_msgs/msg/Float64', float64, COMMAND, TIME, times),
        ('/x', 'std_msgs/msg/Float64', float64, MEASURED[kept], TIME[kept], times[kept]),
    )
    channels = mapped('/u', '/x')
    with pytest.raises(InputError, match=r'measured: nothing for .* after 0\.69.*--split'):
        read(path, channels, warn=lambda _: None)
    gaps: list[str] = []
    records = read(path, channels, gap=gaps.append, warn=lambda _: None)
    assert (len(gaps), len(records)) == (1, 2)
    assert [len(r) for r in records] == pytest.approx([699, 1300 - missing], abs=2)


def test_late_messages_are_no_gap(tmp_path: Path) -> None:
    """A pause of the recorder after which the clock goes on as if nothing had been."""
    times = TIME + 0.0
    times[500] += 1e-3 - 1e-6  # one waits for its successor
    path = bag(
        tmp_path / 'bag',
        ('/u', 'std_msgs/msg/Float64', float64, COMMAND, TIME, times),
        ('/x', 'std_msgs/msg/Float64', float64, MEASURED, TIME, times),
    )
    assert len(read(path, mapped('/u', '/x'), warn=lambda _: None)) == 1


@pytest.mark.parametrize(
    ('command', 'more', 'words'),
    [
        ('/nothing', {}, '/nothing is no number of a topic'),
        ('/u.fata', {}, r'/u\.fata is no number'),
        ('/u', {'stamps': 'header'}, 'header stamps'),
        ('/late', {}, 'do not overlap in time'),
    ],
)
def test_maps_that_do_not_fit(
    tmp_path: Path, command: str, more: dict[str, str], words: str
) -> None:
    """A topic or field that is not there, stamps that are not there, tests apart."""
    path = bag(
        tmp_path / 'bag',
        ('/u', 'std_msgs/msg/Float64', float64, COMMAND, TIME, TIME),
        ('/x', 'std_msgs/msg/Float64', float64, MEASURED, TIME, TIME),
        ('/late', 'std_msgs/msg/Float64', float64, COMMAND, TIME, TIME + 100.0),
    )
    with pytest.raises(InputError, match=words):
        read(path, mapped(command, '/x', **more))


def test_a_type_that_is_no_name_is_refused(tmp_path: Path) -> None:
    """Definitions in a bag are parsed, never run."""
    from mcap.writer import Writer as McapWriter

    path = tmp_path / 'a.mcap'
    with path.open('wb') as file:
        writer = McapWriter(file)
        writer.start(profile='ros2', library='x')
        evil = 'x/msg/A:\n  __import__("os").abort()\nclass B'
        schema = writer.register_schema(evil, 'ros2msg', b'float64 data')
        channel = writer.register_channel('/u', 'cdr', schema)
        writer.add_message(channel, 1, b'\0\1\0\0' + bytes(8), 1)
        writer.finish()
    with pytest.raises(InputError, match='no name of a message type'):
        read(path, mapped('/u', '/u'))
