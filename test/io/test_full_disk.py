"""Disks that are full, read-only or broken: one message, and what was written is kept."""

import errno
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.errors import InputError
from actuator_glue.io.bag_records import read_records, write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.recover import recover
from actuator_glue.records import Record

STARVED = textwrap.dedent(
    """
    import resource, signal, sys
    import numpy as np
    from actuator_glue.errors import InputError
    from actuator_glue.io.bag_records import write_record
    from actuator_glue.io.bag_writer import BagWriter
    from actuator_glue.records import Record

    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))
    values = np.arange(50_000) * 1e-6
    writer = BagWriter(sys.argv[1], flush_period=0.0)
    for attempt in range(2):
        try:
            write_record(writer, Record(values, values, 1e-3), block=50)
        except InputError as error:
            print(error)
    try:
        writer.close()
    except InputError as error:
        print(error)
    """
)


def test_a_full_disk_is_one_message_and_keeps_the_rest(tmp_path: Path) -> None:
    """The message comes back on every later call; what was flushed is readable and mendable."""
    done = subprocess.run(
        [sys.executable, '-c', STARVED, str(tmp_path / 'bag')], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 3
    assert all('full' in line and 'recover' in line for line in lines)
    assert done.stderr == ''
    recover(tmp_path / 'bag')
    (record,) = read_records(tmp_path / 'bag')
    assert len(record) > 5_000
    assert record.command.tobytes() == (np.arange(len(record)) * 1e-6).tobytes()


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
