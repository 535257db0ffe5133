"""Disks that are full, read-only or broken: one message, and what was written is kept."""

import errno
import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import messages, summarise
from actuator_glue.io.bag_records import read_records, write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.json_file import write_json
from actuator_glue.io.recover import recover
from actuator_glue.records import Record

# Numbered blocks of 1.6 kB; `blocks(bag)` are the numbers that a bag holds, in its order.
NUMBERED = textwrap.dedent(
    """
    import resource, sys
    from pathlib import Path
    import numpy as np
    from actuator_glue.errors import InputError
    from actuator_glue.io.bag_reader import decoded, summarise
    from actuator_glue.io.bag_writer import BagWriter
    from actuator_glue.io.mcap_file import DiskError
    from actuator_glue.io.messages import header, message
    from actuator_glue.io.recover import recover

    def write(writer, numbers):
        refused = 0
        for n in numbers:
            content = message(
                'SampleBlock',
                header=header(10**18, 'rig'),
                index=n,
                period=1e-3,
                command=np.full(100, float(n)),
                measured=np.zeros(100),
                force=np.empty(0),
            )
            try:
                writer.write('/samples', content, 10**18 + n)
            except DiskError as error:
                refused += 1
                assert 'full' in str(error) and 'kept' in str(error), error
        return refused

    def blocks(bag):
        return [m.index for _, m in decoded(bag, ('SampleBlock',))]

    def whole(bag):
        assert summarise(bag).finished and (bag / 'metadata.yaml').exists()
        assert recover(bag).notes == [], recover(bag).notes
        assert all(m.command[0] == m.index for _, m in decoded(bag, ('SampleBlock',)))

    bag = Path('disk/bag')
    """
)


def on_small_disk(tmp_path: Path, script: str, *, size: str = '3m') -> None:
    """Run a script whose folder `disk` is a disk of its own, where users may mount one."""
    (tmp_path / 'disk').mkdir()
    (tmp_path / 'script.py').write_text(NUMBERED + textwrap.dedent(script))
    mount = f'mount -t tmpfs -o size={size} tmpfs disk || exit 77; exec {sys.executable} script.py'
    command = ['unshare', '--map-root-user', '--mount', 'sh', '-c', mount]
    try:
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    except OSError as error:
        pytest.skip(f'no mount namespaces here ({error})')
    if done.returncode == 77 or 'unshare' in done.stderr:
        pytest.skip(f'no mount namespaces here ({done.stderr.strip()})')
    assert done.returncode == 0, done.stdout + done.stderr


def numbered(writer: BagWriter, numbers: range) -> None:
    for n in numbers:
        writer.write_raw('/test_setup', bytes([0, 1, 0, 0]) + n.to_bytes(4, 'little'), n)
    writer.flush()


def test_what_is_deleted_while_it_is_written_is_brought_back(tmp_path: Path) -> None:
    """Somebody tidies up: until a file is closed its contents are there."""
    bag = tmp_path / 'bag'
    with BagWriter(bag) as writer:
        writer.add_topic('/test_setup', 'TestSetup')
        numbered(writer, range(100))
        shutil.rmtree(bag)
        assert not writer.moved
        numbered(writer, range(100, 200))
        numbered(writer, range(200, 300))
        assert writer.brought_back == 1
        (bag / 'bag_1.mcap').unlink()
    assert [m.log_time for m in messages(bag)] == list(range(300))
    assert summarise(bag).finished and recover(bag).notes == []


def test_what_is_moved_while_it_is_written_is_told_from_what_is_deleted(tmp_path: Path) -> None:
    bag, away = tmp_path / 'bag', tmp_path / 'away'
    with BagWriter(bag) as writer:
        writer.add_topic('/test_setup', 'TestSetup')
        numbered(writer, range(100))
        bag.rename(away)
        assert writer.moved
        numbered(writer, range(100, 200))
        away.rename(bag)
        assert not writer.moved
    assert not writer.moved and summarise(bag).finished
    assert [m.log_time for m in messages(bag)] == list(range(200))


def test_a_finished_file_that_is_deleted_is_said(tmp_path: Path) -> None:
    bag = tmp_path / 'bag'
    writer = BagWriter(bag, max_file_bytes=1)
    writer.add_topic('/test_setup', 'TestSetup')
    for n in range(3):
        numbered(writer, range(n, n + 1))
    (bag / 'bag_1.mcap').unlink()
    with pytest.raises(InputError, match=r'bag_1.mcap with 1 messages was deleted'):
        writer.close()
    assert [m.log_time for m in messages(bag)] == [0, 2] and writer.count == 2


def test_what_a_full_disk_refuses_is_written_when_there_is_room(tmp_path: Path) -> None:
    """Not one message is missing, none comes twice; the bag needs no mending."""
    script = """
        Path('disk/other').write_bytes(bytes(1 << 20))
        writer = BagWriter(bag, flush_period=0.01)
        writer.add_topic('/samples', 'SampleBlock')
        refused = write(writer, range(1200))
        assert 10 < refused < 1000 and writer.waiting == refused, (refused, writer.waiting)
        assert summarise(bag / 'bag_0.mcap').finished  # while the disk is full
        Path('disk/other').unlink()
        writer.flush()
        assert writer.waiting == 0
        assert write(writer, range(1200, 1300)) == 0
        writer.close()
        assert blocks(bag) == list(range(1300))
        assert writer.count == 1300
        whole(bag)
    """
    on_small_disk(tmp_path, script)


@pytest.mark.slow
def test_a_bag_on_a_disk_that_stays_full_is_finished_and_says_what_it_lacks(
    tmp_path: Path,
) -> None:
    """Index and metadata.yaml have had their room from the beginning."""
    script = """
        writer = BagWriter(bag, flush_period=0.01)
        writer.add_topic('/samples', 'SampleBlock')
        assert write(writer, range(2500)) > 10
        with open('disk/other', 'wb', buffering=0) as file:  # not one byte is left
            try:
                while file.write(bytes(4096)): pass
            except OSError: pass
        lost = writer.waiting
        try:
            writer.close()
            raise SystemExit('it says nothing')
        except DiskError as error:
            assert 'is full' in str(error) and f'{lost} messages were not' in str(error), error
        assert blocks(bag) == list(range(2500 - lost))
        whole(bag)
    """
    on_small_disk(tmp_path, script)


def test_where_nothing_was_written_nothing_is_said_to_be_kept(tmp_path: Path) -> None:
    """And no folder is left that would be in the way of the next attempt."""
    script = """
        try:
            BagWriter(bag)
            raise SystemExit('it says nothing')
        except DiskError as error:
            assert 'is full' in str(error), error
            assert 'kept' not in str(error) and 'recover' not in str(error), error
        assert not bag.exists()
    """
    on_small_disk(tmp_path, script, size='100k')


LIMITED = textwrap.dedent(
    """
    bag = Path(sys.argv[1])
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 2_000_000))
    writer = BagWriter(bag, flush_period=0.0)
    writer.add_topic('/samples', 'SampleBlock')
    assert 0 < write(writer, range(500)) < 10
    resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, 2_000_000))
    writer.close()
    assert blocks(bag) == list(range(500))
    whole(bag)
    """
)


def test_what_a_file_does_not_take_goes_into_the_next_one(tmp_path: Path) -> None:
    """A limit that no reservation foresees cuts the file; what it had not taken is not lost."""
    script = [sys.executable, '-c', NUMBERED + LIMITED, str(tmp_path / 'bag')]
    done = subprocess.run(script, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(list((tmp_path / 'bag').glob('*.mcap'))) > 2


def test_a_next_file_that_cannot_be_made_is_said_again_and_again(
    tmp_path: Path, record: Record
) -> None:
    """What was written stays whole; whoever goes on writing is told each time, not thrown out."""
    writer = BagWriter(tmp_path / 'bag', flush_period=0.0, max_file_bytes=1)
    (tmp_path / 'bag' / 'bag_1.mcap').mkdir()
    for _ in range(3):
        with pytest.raises(InputError, match=r'bag_?.*cannot be (made|written)'):
            write_record(writer, record)
    with pytest.raises(InputError):
        writer.close()
    (tmp_path / 'bag' / 'bag_1.mcap').rmdir()
    assert recover(tmp_path / 'bag').messages > 0


def test_a_disk_that_does_not_take_what_was_flushed_is_said(
    tmp_path: Path, record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An error of the disk itself comes late, when the file is synchronised, or never."""
    writer = BagWriter(tmp_path / 'bag')
    write_record(writer, record)
    writer.sync()

    def broken(_: int) -> None:
        raise OSError(errno.EIO, 'Input/output error')

    monkeypatch.setattr(os, 'fdatasync', broken)
    with pytest.raises(InputError, match='bag'):
        writer.sync()
    writer.close()
    writer.sync()  # nothing is left to wait for
    assert len(read_records(tmp_path / 'bag')[0]) == len(record)


def test_a_read_only_disk_is_said(tmp_path: Path) -> None:
    """In a mount of its own, where this system lets users make one."""
    script = (
        'from actuator_glue.io.bag_writer import BagWriter\n'
        'from actuator_glue.errors import InputError\n'
        'try: BagWriter("disk/bag")\n'
        'except InputError as error: print(error)\n'
    )
    mount = f"mkdir disk && mount -t tmpfs -o ro tmpfs disk && {sys.executable} -c '{script}'"
    command = ['unshare', '--map-root-user', '--mount', 'sh', '-c', mount]
    try:
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f'no mount namespaces here ({error})')
    assert 'the disk is read-only' in done.stdout


def test_json_that_cannot_be_finished_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half of it stayed beside the name that was asked for."""

    def full(file: Path, text: str, encoding: str) -> None:
        file.write_bytes(text[:10].encode(encoding))
        raise OSError(errno.ENOSPC, 'No space left on device')

    monkeypatch.setattr(Path, 'write_text', full)
    with pytest.raises(InputError, match=r'a\.json: cannot be written \(No space left'):
        write_json({'one': 1}, str(tmp_path / 'a.json'))
    assert not list(tmp_path.iterdir())
