"""Write rosbag2 bags (MCAP) that survive a killed process.

rosbag2's own layout, `NAME/NAME_0.mcap` and `NAME/metadata.yaml`. Messages leave the process in
small chunks at least every `flush_period`, so a SIGKILL loses no more than that; metadata.yaml is
renamed into place when everything else is on the disk, so a bag that has it is finished.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.io.bag_metadata import BagTopic, Metadata, Qos
from actuator_glue.io.mcap_file import McapFile, disk_error
from actuator_glue.io.messages import PACKAGE, message_type, serialize, trimmed

FLUSH_PERIOD = 0.2  # s
# A file's index is kept in memory until the file is finished, about 0.6 kB per chunk. A new file
# per gigabyte or per 1500 flushes (five minutes at five per second) keeps that below a megabyte,
# and of what a killed process leaves only the last file needs mending.
MAX_FILE_BYTES = 1 << 30
MAX_FILE_FLUSHES = 1500


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
        self._topics: dict[str, BagTopic] = {}
        self._definitions: dict[str, str] = {}
        self._last_time = -1
        self._closed = False
        try:
            self.path.mkdir(parents=True)
        except FileExistsError as error:
            raise InputError(
                f'{self.path} exists already; choose another name or move it'
            ) from error
        except OSError as error:
            raise disk_error(self.path, error) from error
        self._file = self._next_file()

    @property
    def count(self) -> int:
        """Messages written so far."""
        return sum(part.count for part in self.metadata.parts)

    def add_topic(
        self,
        name: str,
        type_name: str,
        *,
        qos: Iterable[Qos] = (Qos(),),
        definition: str | None = None,
        rihs01: str = '',
    ) -> None:
        """Declare a topic; repeating the same declaration does nothing.

        Args:
            name: topic, e.g. `/samples`.
            type_name: message type; a bare name is one of actuator_glue_msgs.
            qos: offered profiles, one per publisher.
            definition: ros2msg text of a type that is neither ours nor of ROS 2 Jazzy.
            rihs01: its hash.

        Raises:
            InputError: unknown type, the topic has another type already, disk full.
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
        topic = BagTopic(name, type_name, rihs01, [q.as_dict() for q in qos])
        self._file.add_topic(topic, definition)
        self._topics[name] = topic
        self._definitions[type_name] = definition
        self.metadata.topics.append(topic)

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
        declared = self._declared(topic)
        if declared.type.startswith(PACKAGE):
            # Spare bytes at the end are harmless to ROS, but rosbags refuses such messages.
            data = trimmed(declared.type, data)
        self._write(declared, data, log_time, publish_time)

    def write(self, topic: str, content: Any, log_time: int) -> None:
        """Serialize and write a message object made by `messages.message`.

        Raises:
            InputError: as write_raw.
        """
        declared = self._declared(topic)
        self._write(declared, serialize(declared.type, content), log_time, None)

    def _declared(self, topic: str) -> BagTopic:
        if self._closed:
            raise InputError(f'{self.path}: the bag is closed')
        if topic not in self._topics:
            raise InputError(f'{self.path}: topic {topic} was not declared with add_topic')
        return self._topics[topic]

    def _write(
        self, topic: BagTopic, data: bytes, log_time: int, publish_time: int | None
    ) -> None:
        log_time = max(int(log_time), self._last_time + 1, 0)
        self._last_time = log_time
        published = log_time if publish_time is None else max(int(publish_time), 0)
        self._file.write(topic, data, log_time, published)
        self.flush_if_due()

    def flush_if_due(self) -> None:
        """Flush where the last flush is older than `flush_period`; call it also when idle.

        Raises:
            InputError: disk full.
        """
        if not self._closed and time.monotonic() - self._flushed >= self._flush_period:
            self.flush()

    def flush(self) -> None:
        """Hand everything written so far to the operating system.

        Raises:
            InputError: disk full.
        """
        self._file.flush()
        self._flushed = time.monotonic()
        if self._file.size >= self._max_file_bytes or self._file.flushes >= MAX_FILE_FLUSHES:
            self._file.finish(self.metadata.serialized())
            try:
                self._file = self._next_file()
            except InputError as error:
                self._file.refuse(error)
                raise

    def sync(self) -> None:
        """Wait until the disk has what was flushed; any thread may call this.

        Raises:
            InputError: the disk does not take it.
        """
        self._file.sync()

    def close(self) -> None:
        """Finish the bag: index, fsync, metadata.yaml in one step; closing twice is harmless.

        Raises:
            InputError: disk full; what was flushed before stays readable.
        """
        if self._closed:
            return
        self._closed = True
        self._file.finish(self.metadata.serialized())
        try:
            self.metadata.write(self.path)
        except OSError as error:
            raise disk_error(self.path, error) from error

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        # What was recorded before an error is worth as much as what comes after none; a full
        # disk has already been told.
        try:
            self.close()
        except InputError:
            if error is None:
                raise

    def _next_file(self) -> McapFile:
        name = f'{self.path.name}_{len(self.metadata.parts)}.mcap'
        file = McapFile(self.path / name, self.path)
        for topic in self._topics.values():
            file.add_topic(topic, self._definitions[topic.type])
        self.metadata.parts.append(file.part)
        self._flushed = time.monotonic()
        return file
