"""One .mcap file of a bag while it is written."""

from __future__ import annotations

import errno
import fcntl
import io
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import yaml
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata, Schema
from mcap.writer import CompressionType, Writer

from actuator_glue.errors import InputError
from actuator_glue.io.bag_metadata import BagFile, BagTopic
from actuator_glue.io.disk_room import reserve

CHUNK_BYTES = 64 * 1024
# Room on the disk is reserved in such steps [B], always for the end of the file, too.
STEP_BYTES = 256 * 1024
# Parts of that end: per file, per chunk, and per topic in a chunk [B].
END_BYTES, CHUNK_END_BYTES, TOPIC_END_BYTES = 64 * 1024, 200, 16
# Overhead of a message beyond its data [B], and size of a chunk over that of its messages.
MESSAGE_BYTES, CHUNK_SHARE = 64, 1.02


class DiskError(InputError):
    """The disk does not take a bag now: it is full, read-only or broken."""


class Message(NamedTuple):
    """A serialized message and its times [ns]."""

    topic: BagTopic
    data: bytes
    log_time: int
    publish_time: int


class McapFile:
    """File in rosbag2's MCAP profile, uncompressed small chunks.

    Where the file system lets it, room for what is written and for the end of the file is
    reserved: a file on a disk that gets full can still be finished.

    Args:
        path: file to make; must not exist.
        bag: what messages call the bag.
        spare: room for `finish`'s text, besides [B].
        kept: whether something was written before, which errors then say.

    Attributes:
        path: the file.
        part: name, times and number of messages, for metadata.yaml.
        size: bytes that are surely whole on the disk.
        flushes: how often `flush` was called.
        unsure: messages since the last `flush`; once the disk has failed they are gone from the
            file and from all counts.

    Raises:
        DiskError: the file exists or cannot be written.
    """

    def __init__(self, path: Path, bag: Path, spare: int = 0, *, kept: bool = True) -> None:
        self.path = path
        self.part = BagFile(path.name)
        self.size = 0
        self.flushes = 0
        self.unsure: list[Message] = []
        self._bag = bag
        self._kept = kept
        self._kept_part = replace(self.part)
        self._failure: DiskError | None = None
        self._raw: io.FileIO | None = None
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, str], int] = {}
        # Upper bound of the bytes written, room for the file's end, and bytes reserved [B].
        self._bound, self._end, self._reserved = 0, END_BYTES + spare, 0
        try:
            self._begin()
        except DiskError:
            if self._raw is not None:  # ours, and empty
                with suppress(OSError):
                    path.unlink()
            raise

    def _begin(self) -> None:
        with self._disk():
            self._raw = io.FileIO(self.path, 'x')
            with suppress(OSError):  # some network disks cannot lock; the lock only guards
                fcntl.flock(self._raw, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._stream = io.BufferedWriter(self._raw, 2 * CHUNK_BYTES)
            self._writer = Writer(
                self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.NONE
            )
            self._writer.start(profile='ros2', library='actuator_glue')
        self._make_room(STEP_BYTES)

    def add_topic(self, topic: BagTopic, definition: str) -> None:
        """Declare a topic once, with the ros2msg text of its type.

        Raises:
            DiskError: disk full.
        """
        qos = yaml.safe_dump(topic.qos, sort_keys=False)
        schema = Schema(1, definition.encode(), 'ros2msg', topic.type)
        self.add_channel(
            topic, schema, {'offered_qos_profiles': qos, 'topic_type_hash': topic.rihs01}
        )

    def add_channel(self, topic: BagTopic, schema: Schema, metadata: Mapping[str, str]) -> None:
        """Declare a topic once, as another file has it.

        Args:
            topic: its name, type and encoding.
            schema: of its type, of any encoding; its id is 0 where there is none.
            metadata: what the file says of the topic besides.

        Raises:
            DiskError: disk full.
        """
        # The declaration is written where the topic begins and again at the end.
        told = sum(len(k.encode()) + len(v.encode()) for k, v in metadata.items())
        said = 1024 + len(topic.name) + told + len(schema.data)
        self._end += said + TOPIC_END_BYTES
        self._make_room(said)
        kind = (schema.name, schema.encoding, schema.data)
        with self._disk():
            if schema.id and kind not in self._schemas:
                self._schemas[kind] = self._writer.register_schema(*kind)
            self._channels[topic.key] = self._writer.register_channel(
                topic.name, topic.encoding, self._schemas[kind] if schema.id else 0, dict(metadata)
            )

    def add_beside(self, opcode: int, body: bytes) -> None:
        """Write an attachment or a metadata record as another file has it.

        Raises:
            DiskError: disk full.
        """
        self._make_room(2 * len(body) + MESSAGE_BYTES)
        self._end += MESSAGE_BYTES + len(body)
        stream = ReadDataStream(io.BytesIO(body))
        with self._disk():
            if opcode == Opcode.METADATA:
                record = Metadata.read(stream)
                self._writer.add_metadata(record.name, record.metadata)
            else:
                held = Attachment.read(stream)
                self._writer.add_attachment(
                    held.create_time, held.log_time, held.name, held.media_type, held.data
                )

    def write(self, message: Message) -> None:
        """Write one serialized message of a declared topic.

        Raises:
            DiskError: disk full; the message is not in the file.
        """
        topic = message.topic
        self._make_room(int(CHUNK_SHARE * len(message.data)) + MESSAGE_BYTES)
        with self._disk():
            self._writer.add_message(
                channel_id=self._channels[topic.key],
                log_time=message.log_time,
                data=message.data,
                publish_time=message.publish_time,
                sequence=topic.count & 0xFFFFFFFF,
            )
        self.unsure.append(message)
        topic.count += 1
        self.part.add(message.log_time)

    def flush(self) -> None:
        """Hand everything to the operating system, so that a SIGKILL cannot take it.

        Raises:
            DiskError: disk full.
        """
        with self._disk():
            self._writer.flush()
            before, self.size = self.size, self._stream.tell()
        chunks = 1 + (self.size - before) // CHUNK_BYTES
        self._end += chunks * (CHUNK_END_BYTES + TOPIC_END_BYTES * len(self._channels))
        self._bound = self.size
        self._sure()
        self.flushes += 1

    def sync(self) -> None:
        """Wait until the disk has what was flushed: a power cut cannot take it then.

        Another thread may call this while the file is written.

        Raises:
            DiskError: the disk does not take it.
        """
        try:
            if self._raw is not None:
                os.fdatasync(self._raw.fileno())
        except ValueError:  # closed meanwhile by a call that waited for the disk itself
            return
        except OSError as error:
            if error.errno != errno.EBADF:
                # The disk may not have taken what was handed to the system.
                raise disk_error(self._bag, error, kept=False) from error

    def finish(self, serialized_metadata: str) -> None:
        """Write index and end, and wait until the disk has them.

        Raises:
            DiskError: disk full; what was flushed before stays readable.
        """
        with self._disk():
            self._writer.add_metadata('rosbag2', {'serialized_metadata': serialized_metadata})
            self._writer.finish()
            self._stream.flush()
            assert self._raw is not None
            self._raw.truncate()  # gives back the room that was reserved beyond
            if self.removed:
                self._bring_back()
            os.fsync(self._raw.fileno())
            self._stream.close()
        self._sure()

    @property
    def removed(self) -> bool:
        """Whether somebody has deleted the file, which is written all the same."""
        raw = self._raw
        return raw is not None and not raw.closed and not os.fstat(raw.fileno()).st_nlink

    def _bring_back(self) -> None:
        """Write a deleted file anew: its contents are there until it is closed."""
        assert self._raw is not None
        self.path.parent.mkdir(parents=True, exist_ok=True)
        contents = Path(f'/proc/self/fd/{self._raw.fileno()}')
        with contents.open('rb') as held, self.path.open('xb') as copy:
            shutil.copyfileobj(held, copy)
            copy.flush()
            os.fsync(copy.fileno())

    def _make_room(self, more: int) -> None:
        """Have room for so many bytes and for the end of the file; the file stays as it is.

        Raises:
            DiskError: the disk has no room for them.
        """
        wanted = self._bound + more + self._end
        if wanted > self._reserved and self._raw is not None and not self._raw.closed:
            try:
                reserve(self._raw.fileno(), self._reserved, wanted + STEP_BYTES - self._reserved)
            except OSError as error:
                kept = self._kept or self.size > 0
                raise disk_error(self._bag, error, kept=kept) from error
            self._reserved = wanted + STEP_BYTES
        self._bound += more

    def _sure(self) -> None:
        """Note that all messages so far are in the file."""
        self.unsure.clear()
        self._kept_part = replace(self.part)

    @contextmanager
    def _disk(self) -> Iterator[None]:
        """Turn an error of the disk into one clear message and keep the file readable."""
        if self._failure is not None:
            raise self._failure
        try:
            yield
        except OSError as error:
            kept = self._kept or self.size > 0
            self._failure = disk_error(self._bag, error, kept=kept)
            if self._raw is not None:
                # Cut off a half-written chunk: everything before it then reads cleanly.
                with suppress(OSError, ValueError):
                    self._raw.truncate(self.size)
                with suppress(OSError):
                    self._raw.close()
            for message in self.unsure:
                message.topic.count -= 1
            part, before = self.part, self._kept_part
            part.start, part.stop, part.count = before.start, before.stop, before.count
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


def disk_error(path: Path, error: OSError, *, kept: bool = True) -> DiskError:
    """Return what to tell when a bag cannot be written.

    Args:
        path: the bag.
        error: of the operating system.
        kept: whether something was written before.
    """
    rest = '; what was written before is kept' if kept else ''
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return DiskError(f'{path}: the disk or the quota is full ({error.strerror}){rest}')
    if error.errno == errno.EROFS:
        return DiskError(f'{path}: the disk is read-only{rest}')
    if error.errno in (errno.EACCES, errno.EPERM):
        return DiskError(f'{path}: no permission to write ({error.strerror}); choose another')
    if error.errno in (errno.ENOTDIR, errno.ENAMETOOLONG, errno.EEXIST):
        return DiskError(f'{path}: cannot be made ({error.strerror}); choose another name')
    return DiskError(f'{path}: cannot be written ({error.strerror or error}){rest}')
