"""Write rosbag2 bags (MCAP) that survive a killed process.

rosbag2's own layout, `NAME/NAME_0.mcap` and `NAME/metadata.yaml`. Messages leave the process in
small chunks at least every `flush_period`, so a SIGKILL loses no more than that; metadata.yaml is
renamed into place when everything else is on the disk, so a bag that has it is finished.

On a disk that gets full the file being written is finished, in room that was kept for that; what
comes then waits in memory until there is room for the next file.
"""

from __future__ import annotations

import shutil
import threading
import time
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.io import recover
from actuator_glue.io.bag_metadata import BagTopic, Metadata, Qos
from actuator_glue.io.mcap_file import DiskError, McapFile, Message, disk_error
from actuator_glue.io.messages import PACKAGE, message_type, serialize, trimmed

FLUSH_PERIOD = 0.2  # s
# A file's index is kept in memory until the file is finished, about 0.6 kB per chunk. A new file
# per gigabyte or per 1500 flushes (five minutes at five per second) keeps that below a megabyte,
# and of what a killed process leaves only the last file needs mending.
MAX_FILE_BYTES = 1 << 30
MAX_FILE_FLUSHES = 1500


class BagWriter:
    """Writer of one bag; use as a context manager, and from any thread.

    A message that the disk does not take is kept, and written first as soon as a later call finds
    that the disk takes messages again.

    Log times are made strictly increasing (by 1 ns steps where they are not), because the order
    of equal stamps is not defined when a bag is played; header stamps stay as they are.

    A file that somebody deletes while it is written is brought back.

    Args:
        path: folder of the bag; must not exist.
        flush_period: longest time a message stays in the process [s].
        max_file_bytes: size at which the next file is begun.

    Attributes:
        brought_back: files that were deleted while they were written.

    Raises:
        InputError: the bag exists.
        DiskError: it cannot be written (permission, disk full).
    """

    def __init__(
        self,
        path: Path | str,
        *,
        flush_period: float = FLUSH_PERIOD,
        max_file_bytes: int = MAX_FILE_BYTES,
    ) -> None:
        self.path = Path(path)
        self.metadata = Metadata()
        self._flush_period = flush_period
        self._max_file_bytes = max_file_bytes
        self._topics: dict[str, BagTopic] = {}
        self._definitions: dict[str, str] = {}
        self._last_time = -1
        self._closed = False
        self._lock = threading.RLock()
        self._waiting: deque[Message] = deque()
        self._cut: list[Path] = []  # files that could not be finished
        self._begun = 0
        self.brought_back = 0
        try:
            self.path.mkdir(parents=True)
        except FileExistsError as error:
            raise InputError(
                f'{self.path} exists already; choose another name or move it'
            ) from error
        except OSError as error:
            raise disk_error(self.path, error, kept=False) from error
        try:
            self._file: McapFile | None = self._next_file()
        except DiskError:
            shutil.rmtree(self.path, ignore_errors=True)  # ours, and empty
            raise

    @property
    def count(self) -> int:
        """Messages written so far."""
        return sum(part.count for part in self.metadata.parts)

    @property
    def waiting(self) -> int:
        """Messages that the disk has not taken yet; after `close` those that are lost."""
        return len(self._waiting)

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
        topic = BagTopic(name, type_name, rihs01, [q.as_dict() for q in qos])
        with self._lock:
            self._topics[name] = topic
            self._definitions[type_name] = definition
            self.metadata.topics.append(topic)
            if self._file is not None:
                try:
                    self._file.add_topic(topic, definition)
                except DiskError:
                    self._put_aside()  # the next file has it from its beginning

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
            InputError: topic not declared, bag closed.
            DiskError: the disk does not take it; it is kept and waits.
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
            DiskError: as write_raw.
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
        with self._lock:
            log_time = max(int(log_time), self._last_time + 1, 0)
            self._last_time = log_time
            published = log_time if publish_time is None else max(int(publish_time), 0)
            self._waiting.append(Message(topic, data, log_time, published))
            self._hand_over()
            self.flush_if_due()

    def flush_if_due(self) -> None:
        """Flush where the last flush is older than `flush_period`; call it also when idle.

        Raises:
            DiskError: disk full.
        """
        if not self._closed and time.monotonic() - self._flushed >= self._flush_period:
            self.flush()

    def flush(self) -> None:
        """Hand everything written so far to the operating system, and what waits before it.

        Raises:
            DiskError: disk full.
        """
        with self._lock:
            self._hand_over()
            file = self._file
            if file is None:
                return
            try:
                file.flush()
                self._flushed = time.monotonic()
                removed = file.removed
                if (
                    removed
                    or file.size >= self._max_file_bytes
                    or file.flushes >= MAX_FILE_FLUSHES
                ):
                    file.finish(self.metadata.serialized())
                    self._file = None  # the next message begins another
                    self.brought_back += removed
            except DiskError:
                self._put_aside()
                raise

    @property
    def moved(self) -> bool:
        """Whether the file being written is elsewhere by now; any thread may ask this."""
        file = self._file
        if file is None:
            return False
        try:
            return not file.path.exists() and not file.removed
        except (OSError, ValueError):  # a disk that says nothing, or a file closed meanwhile
            return False

    def sync(self) -> None:
        """Wait until the disk has what was flushed; any thread may call this.

        Raises:
            DiskError: the disk does not take it.
        """
        file = self._file  # without the lock: a disk may take long
        if file is not None:
            file.sync()

    def close(self) -> None:
        """Finish the bag: index, fsync, metadata.yaml in one step; closing twice is harmless.

        Raises:
            DiskError: disk full; what was flushed before stays readable.
        """
        with self._lock:
            if self._closed:
                return
            failure = ''
            for _ in range(2):  # messages of a file that cannot be finished go into another
                try:
                    self._hand_over()
                except DiskError as error:
                    failure = str(error)
                    break
                failure = self._put_aside()
                if not self._waiting:
                    break
            self._closed, gone = True, ''
            if self._waiting:
                failure += f'; {self.waiting} messages were not written'
            try:
                for file in self._cut:
                    recover.mend(file, self.path)
                gone = self._without_deleted()
                self._write_metadata()
                if gone:
                    raise InputError(gone)
            except InputError as error:
                failure = failure or str(error)
                if not gone:
                    failure += f'; `actuator-glue recover {self.path}` finishes the bag'
            else:
                failure = failure if self._waiting else ''
            if failure:
                raise DiskError(failure)

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        # A recording that ends with an error is finished, too; a full disk has been reported
        # before.
        try:
            self.close()
        except InputError:
            if error is None:
                raise

    def _hand_over(self) -> None:
        """Write what waits; begin a file where there is none.

        Raises:
            DiskError: the disk does not take it; what it has not taken still waits.
        """
        if self._waiting and self._file is None:
            self._file = self._next_file()
        try:
            while self._waiting:
                assert self._file is not None
                self._file.write(self._waiting[0])
                self._waiting.popleft()
        except DiskError:
            self._put_aside()
            raise

    def _put_aside(self) -> str:
        """Finish the file being written; what the disk does not take of it waits; return why."""
        file, self._file = self._file, None
        failure = ''
        if file is None:
            return failure
        try:
            file.finish(self.metadata.serialized())
        except DiskError as error:
            failure = str(error)
            self._waiting.extendleft(reversed(file.unsure))
            if file.part.count:
                self._cut.append(file.path)
        if not file.part.count and (failure or len(self.metadata.parts) > 1):
            # The file holds nothing worth keeping.
            self.metadata.parts.remove(file.part)
            with suppress(OSError):
                file.path.unlink()
        return failure

    def _without_deleted(self) -> str:
        """Leave finished files that were deleted out of the bag; return what to tell of them."""
        there = [part for part in self.metadata.parts if (self.path / part.name).exists()]
        gone = [part for part in self.metadata.parts if part not in there]
        self.metadata.parts = there
        if not gone:
            return ''
        lost = sum(part.count for part in gone)
        names = ', '.join(part.name for part in gone)
        return f'{self.path}: {names} with {lost} messages was deleted or moved while recording'

    def _write_metadata(self) -> None:
        try:
            self.metadata.write(self.path)
        except OSError as error:
            raise disk_error(self.path, error) from error

    def _next_file(self) -> McapFile:
        name = f'{self.path.name}_{self._begun}.mcap'
        try:
            self.metadata.reserve(self.path)
        except OSError as error:
            raise disk_error(self.path, error, kept=self._begun > 0) from error
        spare = 2 * len(self.metadata.serialized())
        file = McapFile(self.path / name, self.path, spare, kept=self._begun > 0)
        self._begun += 1
        self.metadata.parts.append(file.part)
        try:
            for topic in self._topics.values():
                file.add_topic(topic, self._definitions[topic.type])
        except DiskError:
            self._file = file
            self._put_aside()
            raise
        self._flushed = time.monotonic()
        return file
