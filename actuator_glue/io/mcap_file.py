"""One .mcap file of a bag while it is written."""

from __future__ import annotations

import errno
import fcntl
import io
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import yaml
from mcap.writer import CompressionType, Writer

from actuator_glue.errors import InputError
from actuator_glue.io.bag_metadata import BagFile, BagTopic

CHUNK_BYTES = 64 * 1024


class McapFile:
    """File in rosbag2's MCAP profile, uncompressed small chunks.

    Args:
        path: file to make; must not exist.
        bag: what messages call the bag.

    Attributes:
        part: name, times and number of messages, for metadata.yaml.
        size: bytes that are surely whole on the disk.
        flushes: how often `flush` was called.

    Raises:
        InputError: the file exists or cannot be written.
    """

    def __init__(self, path: Path, bag: Path) -> None:
        self.part = BagFile(path.name)
        self.size = 0
        self.flushes = 0
        self._bag = bag
        self._failure: InputError | None = None
        self._raw: io.FileIO | None = None
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        with self._disk():
            self._raw = io.FileIO(path, 'x')
            with suppress(OSError):  # some network disks cannot lock; the lock only guards
                fcntl.flock(self._raw, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._stream = io.BufferedWriter(self._raw, 2 * CHUNK_BYTES)
            self._writer = Writer(
                self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.NONE
            )
            self._writer.start(profile='ros2', library='actuator_glue')

    def add_topic(self, topic: BagTopic, definition: str) -> None:
        """Declare a topic once, with the ros2msg text of its type.

        Raises:
            InputError: disk full.
        """
        with self._disk():
            if topic.type not in self._schemas:
                self._schemas[topic.type] = self._writer.register_schema(
                    topic.type, 'ros2msg', definition.encode()
                )
            self._channels[topic.name] = self._writer.register_channel(
                topic.name,
                'cdr',
                self._schemas[topic.type],
                {
                    'offered_qos_profiles': yaml.safe_dump(topic.qos, sort_keys=False),
                    'topic_type_hash': topic.rihs01,
                },
            )

    def write(self, topic: BagTopic, data: bytes, log_time: int, publish_time: int) -> None:
        """Write one serialized message of a declared topic; times in ns.

        Raises:
            InputError: disk full.
        """
        with self._disk():
            self._writer.add_message(
                channel_id=self._channels[topic.name],
                log_time=log_time,
                data=data,
                publish_time=publish_time,
                sequence=topic.count & 0xFFFFFFFF,
            )
        topic.count += 1
        self.part.add(log_time)

    def flush(self) -> None:
        """Hand everything to the operating system, so that a SIGKILL cannot take it.

        Raises:
            InputError: disk full.
        """
        with self._disk():
            self._writer.flush()
            self.size = self._stream.tell()
        self.flushes += 1

    def sync(self) -> None:
        """Wait until the disk has what was flushed: neither power nor disk takes it then.

        Another thread may call this while the file is written.

        Raises:
            InputError: the disk does not take it.
        """
        try:
            if self._raw is not None:
                os.fdatasync(self._raw.fileno())
        except ValueError:  # closed meanwhile, and waited for by whoever closed it
            return
        except OSError as error:
            if error.errno != errno.EBADF:
                raise disk_error(self._bag, error) from error

    def finish(self, serialized_metadata: str) -> None:
        """Write index and end, and wait until the disk has them.

        Raises:
            InputError: disk full; what was flushed before stays readable.
        """
        with self._disk():
            self._writer.add_metadata('rosbag2', {'serialized_metadata': serialized_metadata})
            self._writer.finish()
            self._stream.flush()
            assert self._raw is not None
            os.fsync(self._raw.fileno())
            self._stream.close()

    def refuse(self, failure: InputError) -> None:
        """Have everything from now on fail with this."""
        self._failure = failure

    @contextmanager
    def _disk(self) -> Iterator[None]:
        """Turn an error of the disk into one clear message and keep the file readable."""
        if self._failure is not None:
            raise self._failure
        try:
            yield
        except OSError as error:
            self._failure = disk_error(self._bag, error)
            if self._raw is not None:
                # Cut off a half-written chunk: everything before it then reads cleanly.
                with suppress(OSError, ValueError):
                    self._raw.truncate(self.size)
                with suppress(OSError):
                    self._raw.close()
            raise self._failure from error


def in_use(path: Path) -> bool:
    """Return whether a writer of ours, here or in another process, has the file open."""
    try:
        with path.open('rb') as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


def disk_error(path: Path, error: OSError) -> InputError:
    """Return what to tell when a bag cannot be written."""
    kept = f'; what was written before is kept, `actuator-glue recover {path}` finishes it'
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return InputError(f'{path}: the disk or the quota is full ({error.strerror}){kept}')
    if error.errno == errno.EROFS:
        return InputError(f'{path}: the disk is read-only{kept}')
    if error.errno in (errno.EACCES, errno.EPERM):
        return InputError(f'{path}: no permission to write ({error.strerror}); choose another')
    if error.errno in (errno.ENOTDIR, errno.ENAMETOOLONG, errno.EEXIST):
        return InputError(f'{path}: cannot be made ({error.strerror}); choose another name')
    return InputError(f'{path}: cannot be written ({error.strerror or error}){kept}')
