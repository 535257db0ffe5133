"""Bags: written as rosbag2 does, read back bit by bit."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from actuator_glue.errors import InputError
from actuator_glue.io import messages
from actuator_glue.io.bag_metadata import LATCHED, Qos, qos_profiles
from actuator_glue.io.bag_reader import messages as bag_messages
from actuator_glue.io.bag_reader import summarise
from actuator_glue.io.bag_records import read_records, write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.recover import recover
from actuator_glue.records import Record

Make = Callable[..., Record]


def same(a: Record, b: Record) -> bool:
    """Whether two records hold the same test, bit by bit."""
    channels = [(a.command, b.command), (a.measured, b.measured)]
    if a.force is not None or b.force is not None:
        assert a.force is not None
        assert b.force is not None
        channels.append((a.force, b.force))
    equal = all(x.tobytes() == y.tobytes() for x, y in channels)
    keys = ('period', 'stiffness', 'hold', 'actuator', 'start_ns', 'first_index')
    return equal and all(getattr(a, k) == getattr(b, k) for k in keys)


@pytest.mark.parametrize('block', [1, 7, 64, 10_000])
@pytest.mark.parametrize('hold', ['zoh', 'linear'])
def test_record_survives_a_bag(tmp_path: Path, record: Record, block: int, hold: str) -> None:
    """Samples, set-up and clock come back to the last bit, whatever the block size."""
    record = replace(record, hold=hold)
    with BagWriter(tmp_path / 'bag') as writer:
        write_record(writer, record, block=block)
    (back,) = read_records(tmp_path / 'bag')
    assert same(record, back)


@pytest.mark.parametrize('stiffness', [None, 0.0])
def test_unknown_stiffness_is_not_zero(
    tmp_path: Path, stiffness: float | None, make_record: Make
) -> None:
    """An unknown stiffness and a free actuator are different things."""
    with BagWriter(tmp_path / 'bag') as writer:
        write_record(writer, make_record(stiffness=stiffness, force=False))
    (back,) = read_records(tmp_path / 'bag')
    assert back.stiffness == stiffness
    assert back.force is None


def test_layout_is_rosbag2s(bag: Path) -> None:
    """Names and metadata as `ros2 bag record -s mcap` (Jazzy) makes them."""
    assert sorted(p.name for p in bag.iterdir()) == ['bag_0.mcap', 'metadata.yaml']
    content = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert list(content) == [
        'version',
        'storage_identifier',
        'duration',
        'starting_time',
        'message_count',
        'topics_with_message_count',
        'compression_format',
        'compression_mode',
        'relative_file_paths',
        'files',
        'custom_data',
        'ros_distro',
    ]
    assert content['version'] == 9
    assert content['message_count'] == 33
    assert content['files'][0]['message_count'] == 33
    topics = {t['topic_metadata']['name']: t for t in content['topics_with_message_count']}
    assert topics['/samples']['message_count'] == 32
    qos = topics['/test_setup']['topic_metadata']['offered_qos_profiles']
    assert qos[0]['durability'] == 'transient_local'
    assert len(qos[0]) == 9


def test_mcap_carries_what_rosbag2_reads(bag: Path) -> None:
    """Profile, definitions, QoS, hash and the metadata record, through mcap's own reader."""
    with (bag / 'bag_0.mcap').open('rb') as file:
        reader = make_reader(file)
        assert reader.get_header().profile == 'ros2'
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 33
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            known = messages.message_type(schema.name)
            assert channel.message_encoding == 'cdr'
            assert schema.encoding == 'ros2msg'
            assert schema.data.decode() == known.definition
            assert channel.metadata['topic_type_hash'] == known.rihs01
            assert yaml.safe_load(channel.metadata['offered_qos_profiles'])[0]['history']
        records = [m for m in reader.iter_metadata() if m.name == 'rosbag2']
        assert yaml.safe_load(records[0].metadata['serialized_metadata'])['version'] == 9


def test_rosbags_reads_our_bag(bag: Path, record: Record) -> None:
    """An independent reader finds the same samples and the same type hash."""
    with AnyReader([bag]) as reader:
        samples = [c for c in reader.connections if c.topic == '/samples']
        assert samples[0].digest == messages.message_type('SampleBlock').rihs01
        blocks = [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages(samples)]
    command = np.concatenate([b.command for b in blocks])
    assert command.tobytes() == record.command.tobytes()
    assert [b.index for b in blocks] == list(range(0, 500, 16))


def test_we_read_rosbags_bag(tmp_path: Path, record: Record) -> None:
    """A bag by another writer, as a folder and as a lone .mcap."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    store = messages.typestore()
    name = 'actuator_glue_msgs/msg/SampleBlock'
    with Writer(tmp_path / 'b', version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection('/ns/samples', name, typestore=store)
        for start in range(0, 500, 50):
            part = slice(start, start + 50)
            block = messages.message(
                'SampleBlock',
                header=messages.header(record.stamp_ns(start), 'a'),
                period=record.period,
                index=start,
                command=record.command[part],
                measured=record.measured[part],
                force=np.empty(0),
            )
            writer.write(connection, record.stamp_ns(start), store.serialize_cdr(block, name))
    for path in (tmp_path / 'b', tmp_path / 'b' / 'b.mcap'):
        (back,) = read_records(path)
        assert back.measured.tobytes() == record.measured.tobytes()
        assert back.stiffness is None


@pytest.mark.parametrize('compression', ['NONE', 'LZ4', 'ZSTD'])
def test_chunks_as_rosbag2_may_write_them(tmp_path: Path, bag: Path, compression: str) -> None:
    """`ros2 bag record -s mcap` may compress chunks; a cut one loses its last chunk then."""
    from mcap.writer import CompressionType, Writer

    path = tmp_path / 'ros2.mcap'
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=2000, compression=CompressionType[compression])
        writer.start(profile='ros2')
        channels: dict[str, int] = {}
        for found in bag_messages(bag):
            if found.topic not in channels:
                text = messages.message_type(found.type).definition.encode()
                schema = writer.register_schema(found.type, 'ros2msg', text)
                channels[found.topic] = writer.register_channel(found.topic, 'cdr', schema)
            writer.add_message(
                channels[found.topic], found.log_time, found.data, found.publish_time
            )
        writer.finish()
    (whole,), (back,) = read_records(bag), read_records(path)
    assert same(whole, back)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    notes: list[str] = []
    (part,) = read_records(path, note=notes.append)
    assert 50 < len(part) < 400
    assert len(notes) == 1
    recover(path)
    assert same(read_records(path)[0], part)


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('', []),
        ('[not: a: list', []),
        ('- {history: 1, depth: 7, reliability: 2, durability: 1, liveliness: 1}', None),
        (
            '- {history: keep_last, depth: 7, reliability: best_effort, durability: '
            'transient_local, liveliness: automatic}',
            None,
        ),
        ('- 5', []),
    ],
)
def test_qos_of_older_bags_is_understood(text: str, expected: list[object] | None) -> None:
    """Numbers of bags before Jazzy become the names that version 9 has."""
    wanted = [Qos('best_effort', 'transient_local', 'keep_last', 7).as_dict()]
    assert qos_profiles(text) == (wanted if expected is None else expected)


def test_files_are_split_and_read_as_one(tmp_path: Path, make_record: Make) -> None:
    """A long recording goes on in the next file; memory and files stay small."""
    record = make_record(20_000)
    writer = BagWriter(tmp_path / 'bag', flush_period=0.0, max_file_bytes=100_000)
    with writer:
        write_record(writer, record, block=100)
    files = sorted(p.name for p in (tmp_path / 'bag').glob('*.mcap'))
    assert len(files) > 3
    (back,) = read_records(tmp_path / 'bag')
    assert same(record, back)
    with AnyReader([tmp_path / 'bag']) as reader:
        assert reader.message_count == writer.count == 201
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    assert same(record, read_records(tmp_path / 'bag')[0])


def test_log_times_strictly_increase(tmp_path: Path) -> None:
    """Equal and backward stamps keep their order of arrival."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/s', 'std_msgs/msg/Float64')
        for stamp in (5, 5, 3, 9):
            content = messages.message('std_msgs/msg/Float64', data=float(stamp))
            writer.write('/s', content, stamp)
    times = [m.log_time for m in bag_messages(tmp_path / 'bag')]
    assert times == [5, 6, 7, 9]


def test_writer_says_what_is_wrong(tmp_path: Path) -> None:
    """Existing bag, unknown topic, two types on one topic, unknown type, closed bag."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/a', 'std_msgs/msg/Float64', qos=(Qos(), LATCHED))
        writer.add_topic('/a', 'std_msgs/msg/Float64')
        with pytest.raises(InputError, match='cannot also be'):
            writer.add_topic('/a', 'std_msgs/msg/Int32')
        with pytest.raises(InputError, match='unknown'):
            writer.add_topic('/b', 'nobody_msgs/msg/Nothing')
        with pytest.raises(InputError, match='not declared'):
            writer.write_raw('/c', b'', 0)
    with pytest.raises(InputError, match='closed'):
        writer.write_raw('/a', b'', 0)
    with pytest.raises(InputError, match='exists already'):
        BagWriter(tmp_path / 'bag')


def test_an_error_does_not_lose_what_was_recorded(tmp_path: Path, record: Record) -> None:
    """An exception while recording still leaves a finished bag."""
    with pytest.raises(RuntimeError), BagWriter(tmp_path / 'bag') as writer:
        write_record(writer, record)
        raise RuntimeError
    assert same(record, read_records(tmp_path / 'bag')[0])
    assert summarise(tmp_path / 'bag').finished


def test_foreign_types_are_recorded_raw(tmp_path: Path) -> None:
    """A type of somebody else's package goes in with its own text and comes out untouched."""
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic(
            '/x', 'lab_msgs/msg/Pump', definition='float64 pressure\n', rihs01='RIHS01_00'
        )
        writer.write_raw('/x', b'\x00\x01\x00\x00' + bytes(8), 10, 7)
    (found,) = bag_messages(tmp_path / 'bag')
    assert found.data == b'\x00\x01\x00\x00' + bytes(8)
    assert (found.log_time, found.publish_time) == (10, 7)
    summary = summarise(tmp_path / 'bag')
    assert summary.topics['/x'].rihs01 == 'RIHS01_00'
    assert summary.definitions['lab_msgs/msg/Pump'] == 'float64 pressure\n'


@pytest.mark.parametrize('spare', [0, 3, 4, 8])
def test_rosbags_reads_blocks_with_spare_bytes(tmp_path: Path, spare: int) -> None:
    """What rclpy sends for an empty force array is stored so that rosbags can read it."""
    ones = np.ones(3)
    block = messages.message(
        'SampleBlock',
        header=messages.header(1, 'a'),
        period=1e-3,
        index=0,
        command=ones,
        measured=ones,
        force=ones[:0],
    )
    with BagWriter(tmp_path / 'bag') as writer:
        writer.add_topic('/samples', 'SampleBlock')
        writer.write_raw('/samples', messages.serialize('SampleBlock', block) + bytes(spare), 1)
    with AnyReader([tmp_path / 'bag']) as reader:
        ((connection, _, raw),) = reader.messages()
        assert len(reader.deserialize(raw, connection.msgtype).measured) == 3


@pytest.mark.skipif(sys.platform == 'win32', reason='POSIX permissions and limits')
def test_no_permission_and_no_room(tmp_path: Path) -> None:
    """A folder that cannot be made is one message; so is a file where a folder is needed."""
    (tmp_path / 'file').write_text('')
    with pytest.raises(InputError, match='cannot be made'):
        BagWriter(tmp_path / 'file' / 'bag')
