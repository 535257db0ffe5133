"""Bags that were cut off, damaged or made by an enemy: told, mended, never worse."""

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from actuator_glue.errors import InputError
from actuator_glue.io import messages
from actuator_glue.io.bag_reader import is_bag
from actuator_glue.io.bag_reader import messages as bag_messages
from actuator_glue.io.bag_records import read_records, write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.recover import recover
from actuator_glue.records import Record

Make = Callable[..., Record]


@pytest.fixture(scope='module')
def whole(make_record: Make) -> bytes:
    """The bytes of a small finished .mcap with several chunks."""
    with tempfile.TemporaryDirectory() as folder:
        with BagWriter(Path(folder) / 'bag') as writer:
            write_record(writer, make_record(300).slice(0, 150), block=4)
            writer.flush()
            write_record(writer, make_record(300).slice(150, 300), block=4)
        return (Path(folder) / 'bag' / 'bag_0.mcap').read_bytes()


SLOW_DISK = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]


@settings(max_examples=120, deadline=None, suppress_health_check=SLOW_DISK)
@given(data=st.data())
def test_any_cut_is_readable(whole: bytes, tmp_path: Path, data: st.DataObject) -> None:
    """Cut anywhere: every message before the cut is there, whole, and it is said to be cut."""
    cut = data.draw(st.integers(0, len(whole)))
    path = tmp_path / 'cut.mcap'
    path.write_bytes(whole[:cut])
    notes: list[str] = []
    found = list(bag_messages(path, note=notes.append))
    expected = list(_complete_messages(whole))
    assert [(m.topic, m.data) for m in found] == expected[: len(found)]
    inside = sum(1 for end in _message_ends(whole) if end <= cut)
    assert len(found) == inside
    footer_end = len(whole) - 8
    assert bool(notes) == (cut < footer_end)
    if notes:
        with pytest.raises(InputError, match='recover'):
            read_records(path)


def _complete_messages(whole: bytes) -> list[tuple[str, bytes]]:
    import io

    reader = make_reader(io.BytesIO(whole))
    return [(c.topic, m.data) for _, c, m in reader.iter_messages(log_time_order=False)]


def _message_ends(whole: bytes) -> list[int]:
    """Byte after each message, by walking the records independently of the code under test."""
    ends, at = [], 8
    while at < len(whole) - 8:
        opcode, length = whole[at], int.from_bytes(whole[at + 1 : at + 9], 'little')
        if opcode == 6:
            inner, stop = at + 9 + 40, at + 9 + length
            while inner < stop:
                size = int.from_bytes(whole[inner + 1 : inner + 9], 'little')
                if whole[inner] == 5:
                    ends.append(inner + 9 + size)
                inner += 9 + size
        at += 9 + length
    return ends


@settings(max_examples=150, deadline=None, suppress_health_check=SLOW_DISK)
@given(data=st.data())
def test_damage_never_raises_anything_else(
    whole: bytes, tmp_path: Path, data: st.DataObject
) -> None:
    """Overwritten bytes anywhere: InputError at most, never a crash, never a wrong sample."""
    at = data.draw(st.integers(0, len(whole) - 1))
    junk = data.draw(st.binary(min_size=1, max_size=40))
    path = tmp_path / 'damaged.mcap'
    path.write_bytes(whole[:at] + junk + whole[at + len(junk) :])
    try:
        for _ in bag_messages(path, note=lambda _: None):
            pass
        read_records(path, note=lambda _: None, gap=lambda _: None)
    except InputError as error:
        assert str(path) in str(error) or 'damaged.mcap' in str(error)


@settings(max_examples=60, deadline=None, suppress_health_check=SLOW_DISK)
@given(junk=st.binary(max_size=300))
def test_hostile_files_get_one_message(tmp_path: Path, junk: bytes) -> None:
    """Random bytes, with and without the magic, are refused or read as cut."""
    for prefix in (b'', b'\x89MCAP0\r\n'):
        path = tmp_path / 'hostile.mcap'
        path.write_bytes(prefix + junk)
        with pytest.raises(InputError):
            read_records(path)


def test_a_claimed_size_is_not_believed(tmp_path: Path) -> None:
    """A chunk that claims 2^60 bytes, and a compressed bomb, take no memory."""
    import zstandard

    huge = b'\x06' + (1 << 60).to_bytes(8, 'little') + b'\x00' * 64
    bomb = zstandard.compress(bytes(1 << 26))
    head = bytes(16) + (1 << 40).to_bytes(8, 'little') + bytes(4)
    body = head + (4).to_bytes(4, 'little') + b'zstd' + len(bomb).to_bytes(8, 'little') + bomb
    chunk = b'\x06' + len(body).to_bytes(8, 'little') + body
    for content in (huge, chunk):
        path = tmp_path / 'hostile.mcap'
        path.write_bytes(b'\x89MCAP0\r\n' + content)
        notes: list[str] = []
        assert list(bag_messages(path, note=notes.append)) == []
        assert notes


def test_damaged_chunk_is_left_out(tmp_path: Path, whole: bytes) -> None:
    """A flipped byte inside a chunk costs that chunk, not the bag."""
    total = len(_complete_messages(whole))
    folder = tmp_path / 'bag'
    folder.mkdir()
    first = _message_ends(whole)[0] - 10
    content = bytearray(whole)
    content[first] ^= 0xFF
    (folder / 'bag_0.mcap').write_bytes(content)
    recovery = recover(folder)
    assert any('checksum' in note for note in recovery.notes)
    assert 0 < recovery.messages < total


def test_recover_gives_back_everything_before_the_cut(bag: Path, record: Record) -> None:
    """The mended bag is a finished bag for us and for rosbags; the original is kept."""
    file = bag / 'bag_0.mcap'
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    (bag / 'metadata.yaml').unlink()
    with pytest.raises(InputError, match='actuator-glue recover'):
        read_records(bag)
    recovery = recover(bag)
    assert recovery.rewritten == ['bag_0.mcap']
    assert (bag / 'bag_0.mcap.cut').read_bytes() == content[: len(content) // 2]
    (back,) = read_records(bag)
    assert 100 < len(back) < 400
    assert back.command.tobytes() == record.command[: len(back)].tobytes()
    with AnyReader([bag]) as reader:
        assert reader.message_count == recovery.messages
    again = recover(bag)
    assert again.rewritten == []
    assert again.notes == []


def test_what_a_cut_left_is_said(tmp_path: Path, whole: bytes) -> None:
    """How much is there, and `recover` only where it mends something."""
    path = tmp_path / 'cut.mcap'
    ends = list(_message_ends(whole))
    for size, said in (
        (0, r'is empty \(0 bytes\): there is nothing to recover$'),
        (
            60,
            r'cut off after 60 bytes .*, without one whole message: there is nothing to recover$',
        ),
        (ends[6] + 1, f'cut off after {ends[6] + 1} bytes .*, with 7 whole messages; .* mends it'),
    ):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError, match=said):
            list(bag_messages(path))
        if size < ends[0]:
            with pytest.raises(InputError, match='not one whole message') as found:
                recover(path)
            assert 'mends it' not in str(found.value)


def test_recover_writes_a_lost_metadata_file(bag: Path) -> None:
    """A bag without metadata.yaml but with whole files only lacks that."""
    before = yaml.safe_load((bag / 'metadata.yaml').read_text())
    (bag / 'metadata.yaml').unlink()
    assert recover(bag).rewritten == []
    assert yaml.safe_load((bag / 'metadata.yaml').read_text()) == before


def test_recover_refuses_what_holds_nothing(tmp_path: Path) -> None:
    """An empty file, as rosbag2 leaves after a kill, cannot be mended."""
    folder = tmp_path / 'bag'
    folder.mkdir()
    (folder / 'bag_0.mcap').write_bytes(b'')
    with pytest.raises(InputError, match='not one whole message'):
        recover(folder)


def test_recover_leaves_a_bag_that_is_being_recorded(tmp_path: Path, record: Record) -> None:
    """A running recorder would go on writing into the renamed original."""
    with BagWriter(tmp_path / 'bag') as writer:
        write_record(writer, record)
        with pytest.raises(InputError, match='being recorded'):
            recover(tmp_path / 'bag')


def test_what_is_no_bag(tmp_path: Path) -> None:
    """Missing path, empty folder, sqlite3 bag, bag without samples: one message each."""
    with pytest.raises(InputError, match='no such bag'):
        read_records(tmp_path / 'nothing')
    (tmp_path / 'empty').mkdir()
    assert not is_bag(tmp_path / 'empty')
    with pytest.raises(InputError, match='no bag in MCAP format'):
        read_records(tmp_path / 'empty')
    sqlite = tmp_path / 'sqlite'
    sqlite.mkdir()
    (sqlite / 'metadata.yaml').write_text(
        'rosbag2_bagfile_information:\n  relative_file_paths: [a_0.db3]\n'
    )
    with pytest.raises(InputError, match='ros2 bag convert'):
        read_records(sqlite)
    with BagWriter(tmp_path / 'other') as writer:
        writer.add_topic('/s', 'std_msgs/msg/Float64')
        writer.write('/s', messages.message('std_msgs/msg/Float64', data=1.0), 0)
    with pytest.raises(InputError, match=r'SampleBlock.*/s \(std_msgs'):
        read_records(tmp_path / 'other')


def test_metadata_that_is_none_is_said(bag: Path) -> None:
    """A damaged metadata.yaml is told and recover writes it anew."""
    (bag / 'metadata.yaml').write_text('not: [a bag')
    with pytest.raises(InputError, match='not the metadata'):
        read_records(bag)
    recover(bag)
    assert len(read_records(bag)) == 1


def test_a_missing_file_is_said(bag: Path) -> None:
    """A file that metadata.yaml names but is not there is damage."""
    shutil.copy(bag / 'bag_0.mcap', bag / 'spare')
    (bag / 'bag_0.mcap').unlink()
    with pytest.raises(InputError, match='missing'):
        read_records(bag)
