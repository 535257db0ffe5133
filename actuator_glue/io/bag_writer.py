"""Write rosbag2 bags (MCAP) that survive a killed process.

rosbag2's own layout, `NAME/NAME_0.mcap` and `NAME/metadata.yaml`. Messages leave the process in
small chunks at least every `flush_period`, so a SIGKILL loses no more than that; metadata.yaml is
renamed into place when everything else is on the disk, so a bag that has it is finished.
"""

from __future__ import annotations

import errno
import io
import os
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import yaml
from mcap.writer import CompressionType, Writer

from actuator_glue.errors import InputError
from actuator_glue.io.bag_metadata import Metadata, Part, Qos, Topic
from actuator_glue.io.messages import message_type, serialize

CHUNK_BYTES = 64 * 1024
FLUSH_PERIOD = 0.2  # s
# A file's index is kept in memory until the file is finished (about 0.6 kB per chunk); a new
# file per gigabyte or per 20 000 chunks (an hour at five per second) bounds it.
MAX_FILE_BYTES = 1 << 30
MAX_FILE_CHUNKS = 20_000


class BagWriter:
    """Writer of one bag; use as a context manager.

    Log times are made strictly increasing (by 1 ns steps where they are not), because the order
    of equal stamps is not defined when a bag is played; header stamps stay as they are.

    Args:
        path: folder of the bag; must not exist.
        flush_period: longest time a message stays in the process [s].
        max_file_bytes: size at which the next file is begun.
        custom: text kept in metadata.yaml under `custom_data`.

    Raises:
        InputError: the bag exists, or cannot be written (permission, disk full).
    """

    def __init__(
        self,
        path: Path | str,
        *,
        flush_period: float = FLUSH_PERIOD,
        max_file_bytes: int = MAX_FILE_BYTES,
        custom: dict[str, str] | None = None,
    ) -> None:
        self.path = Path(path)
        self.metadata = Metadata(custom=dict(custom or {}))
        self._flush_period = flush_period
        self._max_file_bytes = max_file_bytes
        self._topics: dict[str, Topic] = {}
        self._definitions: dict[str, str] = {}
        self._channels: dict[str, int] = {}
        self._last_time = -1
        self._failure: InputError | None = None
        self._closed = False
        with self._disk():
            if self.path.exists():
                raise InputError(f'{self.path} exists already; choose another name or move it')
            self.path.mkdir(parents=True)
            self._begin_file()

    @property
    def count(self) -> int:
        """Messages written so far."""
        return sum(part.count for part in self.metadata.parts)

    @property
    def bytes_written(self) -> int:
        """Size of the current file on the disk [bytes]."""
        return self._good

    def add_topic(
        self,
        name: str,
        type_name: str,
        *,
        qos: Iterable[Qos] = (Qos(),),
        definition: str | None = None,
        rihs01: str | None = None,
    ) -> None:
        """Declare a topic; repeating the same declaration does nothing.

        Args:
            name: topic, e.g. `/samples`.
            type_name: message type; a bare name is one of actuator_glue_msgs.
            qos: offered profiles, one per publisher.
            definition: ros2msg text of a type that is neither ours nor of ROS 2 Jazzy.
            rihs01: its hash.

        Raises:
            InputError: unknown type, or the topic has another type already.
        """
        if definition is None:
            known = message_type(type_name)
            type_name, definition, rihs01 = known.name, known.definition, known.rihs01
        if name in self._topics:
            if self._topics[name].type != type_name:
                raise InputError(
                    f'topic {name} is recorded as {self._topics[name].type}; '
                    f'it cannot also be {type_name}'
                )
            return
        topic = Topic(name, type_name, rihs01 or '', [q.as_dict() for q in qos])
        self._topics[name] = topic
        self._definitions[type_name] = definition
        self.metadata.topics.append(topic)
        self._register(topic)

    def write_raw(
        self, topic: str, data: bytes, log_time: int, publish_time: int | None = None
    ) -> None:
        """Write one serialized message.

        Args:
            topic: a declared topic.
            data: CDR bytes with their four-byte encapsulation.
            log_time: time of reception [ns].
            publish_time: time of publication [ns], log_time where not known.

        Raises:
            InputError: topic not declared, disk full, bag closed.
        """
        if self._failure is not None:
            raise self._failure
        if self._closed:
            raise InputError(f'{self.path}: the bag is closed')
        if topic not in self._topics:
            raise InputError(f'{self.path}: topic {topic} was not declared with add_topic')
        log_time = max(int(log_time), self._last_time + 1, 0)
        self._last_time = log_time
        with self._disk():
            self._writer.add_message(
                channel_id=self._channels[topic],
                log_time=log_time,
                data=data,
                publish_time=max(int(log_time if publish_time is None else publish_time), 0),
                sequence=self._topics[topic].count & 0xFFFFFFFF,
            )
        self._topics[topic].count += 1
        self.metadata.parts[-1].add(log_time)
        self.flush_if_due()

    def write(self, topic: str, content: Any, log_time: int) -> None:
        """Serialize and write a message object made by `messages.message`.

        Raises:
            InputError: as write_raw.
        """
        self.write_raw(topic, serialize(self._topics[topic].type, content), log_time)

    def flush_if_due(self) -> None:
        """Flush where the last flush is older than `flush_period`; call it also when idle.

        Raises:
            InputError: disk full.
        """
        if time.monotonic() - self._flushed >= self._flush_period:
            self.flush()

    def flush(self) -> None:
        """Hand everything written so far to the operating system.

        Raises:
            InputError: disk full.
        """
        if self._failure is not None:
            raise self._failure
        with self._disk():
            self._writer.flush()
            self._good = self._stream.tell()
        self._flushed = time.monotonic()
        self._chunks += 1
        if self._good >= self._max_file_bytes or self._chunks >= MAX_FILE_CHUNKS:
            with self._disk():
                self._finish_file()
                self._begin_file()

    def close(self) -> None:
        """Finish the bag: index, fsync, metadata.yaml in one step; closing twice is harmless.

        Raises:
            InputError: disk full; what was flushed before stays readable.
        """
        if self._closed:
            return
        self._closed = True
        if self._failure is not None:
            raise self._failure
        with self._disk():
            self._finish_file()
            self.metadata.write(self.path)

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # What was recorded before an error is worth as much as what comes after none.
        if self._failure is None:
            self.close()

    def _begin_file(self) -> None:
        name = f'{self.path.name}_{len(self.metadata.parts)}.mcap'
        raw = io.FileIO(self.path / name, 'x')
        self._stream = io.BufferedWriter(raw, 2 * CHUNK_BYTES)
        self._raw = raw
        self._writer = Writer(
            self._stream, chunk_size=CHUNK_BYTES, compression=CompressionType.NONE
        )
        self._writer.start(profile='ros2', library='actuator_glue')
        self.metadata.parts.append(Part(name))
        self._flushed = time.monotonic()
        self._chunks = 0
        self._good = 0
        self._schemas: dict[str, int] = {}
        for topic in self._topics.values():
            self._register(topic)

    def _register(self, topic: Topic) -> None:
        if topic.type not in self._schemas:
            data = self._definitions[topic.type].encode()
            self._schemas[topic.type] = self._writer.register_schema(topic.type, 'ros2msg', data)
        self._channels[topic.name] = self._writer.register_channel(
            topic.name,
            'cdr',
            self._schemas[topic.type],
            {
                'offered_qos_profiles': yaml.safe_dump(topic.qos, sort_keys=False),
                'topic_type_hash': topic.rihs01,
            },
        )

    def _finish_file(self) -> None:
        self._writer.add_metadata('rosbag2', {'serialized_metadata': self.metadata.serialized()})
        self._writer.finish()
        self._stream.flush()
        os.fsync(self._raw.fileno())
        self._stream.close()

    @contextmanager
    def _disk(self) -> Iterator[None]:
        """Turn an error of the disk into one clear message and keep the file readable."""
        try:
            yield
        except OSError as error:
            self._failure = InputError(_disk_message(self.path, error))
            raw = getattr(self, '_raw', None)
            if raw is not None:
                # Cut off a half-written chunk: everything before it then reads cleanly.
                with suppress(OSError, ValueError):
                    raw.truncate(self._good)
                with suppress(OSError):
                    raw.close()
            raise self._failure from error


def _disk_message(path: Path, error: OSError) -> str:
    kept = f'; what was written before is kept, `actuator-glue recover {path}` finishes it'
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return f'{path}: the disk or the quota is full ({error.strerror}){kept}'
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f'{path}: no permission to write here ({error.strerror}); choose another folder'
    if error.errno in (errno.ENOTDIR, errno.ENAMETOOLONG):
        return f'{path}: cannot be a folder ({error.strerror}); choose another name'
    return f'{path}: cannot write ({error.strerror or error}){kept}'
