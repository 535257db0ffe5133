"""MCAP files as others write them: channels without a schema, compressed messages and files."""

import json
import shutil
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import yaml
import zstandard
from mcap.reader import make_reader
from mcap.writer import Writer

from actuator_glue.cli.main import main
from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import messages, summarise
from actuator_glue.io.load import load
from actuator_glue.io.mcap_scan import Scan
from actuator_glue.io.recover import recover
from actuator_glue.records import Record

Held = list[tuple[str, str, str, bytes, int, int]]


def rewritten(
    bag: Path,
    path: Path,
    change: Callable[[bytes], bytes] = lambda data: data,
    notes: bool = False,
) -> Path:
    """Write a bag's file anew with other data in its messages, maybe with what is not ours."""
    (source,) = bag.glob('*.mcap')
    with path.open('wb') as file:
        writer = Writer(file, chunk_size=1 << 14)
        writer.start(profile='ros2', library='somebody')
        channels: dict[int, int] = {}
        if notes:
            loose = writer.register_channel('/notes', 'json', 0, {'who': 'operator'})
            alike = writer.register_schema('lab.Pose', 'protobuf', bytes(range(256)))
            foreign = writer.register_channel('/pose', 'protobuf', alike)
        for place, (schema, channel, message) in enumerate(Scan(source, pytest.fail).messages()):
            if channel.id not in channels:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, known, channel.metadata
                )
            times = message.log_time, message.publish_time
            writer.add_message(channels[channel.id], times[0], change(message.data), times[1])
            if notes and place % 5 == 0:
                text = json.dumps({'place': place}).encode()
                writer.add_message(loose, times[0] + 1, text, times[1])
                writer.add_message(foreign, times[0] + 2, bytes([8, place % 128]), times[1])
        if notes:
            writer.add_attachment(1, 2, 'photo.png', 'image/png', bytes(range(200)))
            writer.add_metadata('laboratory', {'rig': 'four'})
        writer.finish()
    return path


def held(path: Path) -> Held:
    """Return all messages of a file as another reader has them."""
    with path.open('rb') as file:
        return [
            (c.topic, c.message_encoding, s.name if s else '', m.data, m.log_time, m.publish_time)
            for s, c, m in make_reader(file).iter_messages(log_time_order=False)
        ]


def test_a_channel_without_a_schema_is_read(tmp_path: Path, bag: Path, record: Record) -> None:
    """A valid file: no damage is told, its topic is named."""
    path = rewritten(bag, tmp_path / 'a.mcap', notes=True)
    found = load(path)
    assert np.array_equal(found.command, record.command)
    summary = summarise(path)
    assert summary.finished and not summary.damage
    assert summary.topics['/notes'].count > 0 and summary.topics['/notes'].encoding == 'json'
    assert {m.type for m in messages(path)} >= {'', 'lab.Pose'}
    assert main(['info', str(path)]) == 0 and main(['map', str(path)]) == 0


@pytest.mark.parametrize('cut', [0, 40, 300, 5000])
def test_recover_keeps_everything_that_is_whole(tmp_path: Path, bag: Path, cut: int) -> None:
    """Channels without a schema, schemas of other kinds, all bytes, times and descriptions."""
    path = rewritten(bag, tmp_path / 'a.mcap', notes=True)
    before = held(path)
    with path.open('rb') as file:
        said = make_reader(file).get_summary()
    assert said is not None
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) - cut])
    done = recover(path)
    assert bool(done.rewritten) == bool(cut)
    after = held(path)
    assert after == before[: len(after)] and len(after) == done.messages
    assert len(after) == len(before) or cut == 5000
    with path.open('rb') as file:
        reader = make_reader(file)
        now = reader.get_summary()
        assert now is not None
        channels = {c.topic: (c.schema_id > 0, c.metadata) for c in now.channels.values()}
        assert channels == {c.topic: (c.schema_id > 0, c.metadata) for c in said.channels.values()}
        kinds = {s.name: (s.encoding, s.data) for s in now.schemas.values()}
        assert kinds == {s.name: (s.encoding, s.data) for s in said.schemas.values()}
        if cut < 5000:
            (attachment,) = reader.iter_attachments()
            assert (attachment.name, attachment.data) == ('photo.png', bytes(range(200)))
            assert {m.name for m in reader.iter_metadata()} == {'laboratory', 'rosbag2'} or not cut


def test_recover_of_a_whole_folder_names_the_encoding(tmp_path: Path, bag: Path) -> None:
    """metadata.yaml of a bag with what is not ours."""
    folder = tmp_path / 'folder'
    folder.mkdir()
    rewritten(bag, folder / 'a_0.mcap', notes=True)
    recover(folder)
    content = yaml.safe_load((folder / 'metadata.yaml').read_text())
    topics = content['rosbag2_bagfile_information']['topics_with_message_count']
    formats = {
        t['topic_metadata']['name']: t['topic_metadata']['serialization_format'] for t in topics
    }
    assert formats['/notes'] == 'json' and formats['/samples'] == 'cdr'


def packed(data: bytes) -> bytes:
    """Return data as rosbag2 compresses messages and files."""
    return zstandard.ZstdCompressor().compress(data)


def streamed(data: bytes) -> bytes:
    """Return data as rosbags compresses files: how long they are is not said."""
    out = BytesIO()
    with zstandard.ZstdCompressor().stream_writer(out, closefd=False) as writer:
        writer.write(data)
    assert zstandard.frame_content_size(out.getvalue()) < 0
    return out.getvalue()


def test_messages_that_rosbag2_has_compressed(tmp_path: Path, bag: Path, record: Record) -> None:
    """Each message by itself (compression_mode: message); recover keeps them so."""
    path = rewritten(bag, tmp_path / 'a.mcap', packed)
    found = load(path)
    assert np.array_equal(found.measured, record.measured)
    assert found.stiffness == record.stiffness
    before = held(path)
    path.write_bytes(path.read_bytes()[:-100])
    recover(path)
    assert held(path) == before


@pytest.mark.parametrize('kept', [slice(-3), slice(4), slice(5)])
def test_a_compressed_message_that_is_damaged_is_told(
    tmp_path: Path, bag: Path, kept: slice
) -> None:
    """With its topic; cut off within its head it ended in the library's own error."""
    path = rewritten(bag, tmp_path / 'a.mcap', lambda data: packed(data)[kept])
    with pytest.raises(InputError, match=r'topic /.* damaged'):
        load(path)


def in_two(data: bytes) -> bytes:
    """Frames one after the other, each with its size: joined files, or one packed in parts."""
    half = len(data) // 2
    return packed(data[:half]) + packed(data[half:])


@pytest.mark.parametrize('folder', [True, False])
@pytest.mark.parametrize('pack', [packed, streamed, in_two])
def test_files_that_rosbag2_or_rosbags_has_compressed(
    tmp_path: Path, bag: Path, record: Record, folder: bool, pack: Callable[[bytes], bytes]
) -> None:
    """Each file as a whole (compression_mode: file), in a bag or alone."""
    copy = tmp_path / 'copy'
    shutil.copytree(bag, copy)
    (plain,) = copy.glob('*.mcap')
    small = plain.with_name(f'{plain.name}.zstd')
    small.write_bytes(pack(plain.read_bytes()))
    plain.unlink()
    content = (copy / 'metadata.yaml').read_text().replace(plain.name, small.name)
    (copy / 'metadata.yaml').write_text(content)
    path = copy if folder else small
    assert np.array_equal(load(path).command, record.command)
    with pytest.raises(InputError, match='compressed as a whole; unpack it'):
        recover(path)


@pytest.mark.parametrize('pack', [packed, streamed])
def test_a_compressed_file_that_is_cut_or_damaged_is_told(
    tmp_path: Path, bag: Path, pack: Callable[[bytes], bytes]
) -> None:
    """What is whole in it can be read on request; what is no such file is refused."""
    (plain,) = bag.glob('*.mcap')
    path = tmp_path / 'a.mcap.zstd'
    small = pack(plain.read_bytes())
    for poor in (small[:-200], small[:-200] + bytes(200), small[: len(small) // 2]):
        path.write_bytes(poor)
        with pytest.raises(InputError, match='cut off'):
            load(path)
        assert summarise(path).damage
    for other in (plain.read_bytes(), b'', small[:5]):
        path.write_bytes(other)
        with pytest.raises(InputError, match=r'unpack it first|cut off'):
            load(path)
