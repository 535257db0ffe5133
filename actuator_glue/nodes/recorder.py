"""Everything the suite publishes, as a bag that a killed process leaves readable."""

from __future__ import annotations

import importlib
import queue
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from actuator_glue.errors import InputError
from actuator_glue.io.bag_metadata import LATCHED, Qos
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.mcap_file import DiskError
from actuator_glue.nodes import base, folders, spin, topics
from actuator_glue.nodes.health import ERROR, Rate
from actuator_glue.nodes.now import begun
from actuator_glue.nodes.parameters import Spec
from actuator_glue.nodes.partners import refusal, type_name

SPECS = (
    Spec(
        'bag',
        '',
        'folder of the bag, empty for ~/.ros/actuator_glue/bag_DATE-TIME',
        read_only=True,
    ),
    Spec('suite', True, 'record the topics of the suite', read_only=True),
    Spec('topics', [''], 'further topics, recorded as soon as they appear', read_only=True),
    Spec('flush_period', 0.2, 'longest time a message stays in memory', 's', 0.01, 10.0, True),
    Spec('max_file', 1 << 30, 'size at which the next file begins', 'B', 1 << 20, 1 << 40, True),
    Spec(
        'max_waiting',
        256 << 20,
        'messages kept in memory while the disk stalls or is full, or /clock has not begun',
        'B',
        1 << 20,
        1 << 40,
    ),
)


SYNC_PERIOD = 1.0  # s after which the disk itself, and not the system's memory, has a message
RETRY_PERIOD = 0.5  # s between two attempts on a disk that takes nothing


class Item(NamedTuple):
    """A message on its way to the disk.

    Attributes:
        topic: fully qualified.
        data: as it came.
        received: by the node's clock [ns]; None before the first /clock.
        published: by the publisher's computer [ns]; None where the middleware does not say.
        arrived: monotonic [s].
    """

    topic: str
    data: bytes
    received: int | None
    published: int | None
    arrived: float


class RecorderNode(base.SuiteNode):
    """Takes messages as bytes; a thread of its own writes them, so that no disk delays DDS."""

    carries = True

    def __init__(self) -> None:
        self.writer: BagWriter | None = None
        self._bags = 0
        super().__init__('recorder', SPECS)

    def do_activate(self) -> None:
        """Open the bag and subscribe."""
        values = self.parameters.values()
        try:
            self.writer = BagWriter(
                self._path(values),
                flush_period=values['flush_period'],
                max_file_bytes=values['max_file'],
            )
        except DiskError as error:
            if values['bag']:
                raise
            raise InputError(f'{error}; name another place with parameter bag') from error
        self._bags += 1
        self.get_logger().info(f'recording to {self.writer.path}')
        self._queue: queue.SimpleQueue[Item | None] = queue.SimpleQueue()
        self._early: list[Item] = []
        self._waiting_bytes = self._lost = self._brought_back = 0
        self._lag = self._worst_lag = 0.0
        self._failed = self._unsynced = ''
        self.received = Rate()
        self._wanted = {name for name in values['topics'] if name}
        self._finished = threading.Event()
        self._thread = threading.Thread(target=self._write, name='writer', daemon=True)
        self._thread.start()
        threading.Thread(target=self._sync, name='sync', daemon=True).start()
        self._heard: dict[str, tuple[topics.Topic, Any]] = {}
        for topic in topics.RECORDED if values['suite'] else ():
            self._record(topic)
        self._look()
        self.every(0.5, self._look)

    def do_deactivate(self) -> None:
        """Write what has arrived and finish the bag; what cannot be written is told."""
        writer = self.writer
        if writer is None:
            return
        self._take_what_waits()
        self._release_early(last=True)
        self._finished.set()
        self._queue.put(None)
        self._thread.join()
        unfinished = ''
        try:
            writer.close()
        except InputError as error:
            unfinished = str(error)
        self._lost += writer.waiting + self.unreceived
        found = f'{writer.path}: {writer.count} messages'
        if self._lost:
            # Nobody may take an incomplete bag for a whole one.
            self.exit_code = 1
            self.complain('lost', f'{found}, {self._lost} more are lost', ERROR)
        if unfinished:
            self.exit_code = 1
            self.complain('bag', unfinished, ERROR)
        elif not self._lost:
            self.get_logger().info(f'{found}, finished')
        self._failed = self._unsynced = ''
        self.do_report()
        self.writer = None

    def do_report(self) -> None:
        """Rate, bag write lag, losses."""
        if self.writer is None:
            return
        self.health.values.update(
            {
                'bag': str(self.writer.path),
                'message rate (1/s)': self.received.per_second(time.monotonic()),
                'messages written': self.writer.count,
                'bag write lag (s)': self._lag,
                'worst bag write lag (s)': self._worst_lag,
                'messages waiting (B)': self._waiting_bytes,
                'messages lost': self._lost,
            }
        )
        if self._failed:
            text = f'{self._failed}; what comes waits in memory until the disk takes it'
            self.complain('bag', text, ERROR)
        if self.writer.brought_back > self._brought_back:
            self._brought_back = self.writer.brought_back
            text = f'a file of {self.writer.path} was deleted while it was recorded'
            self.complain('deleted', f'{text}; its messages are written anew', ERROR)
        if self.writer.moved:
            text = f'{self.writer.path} was moved: what comes is written to where it is now'
            self.complain('moved', f'{text}; move it back, or it stays unfinished', ERROR)
        if self._unsynced:
            self.complain('disk', self._unsynced, ERROR)
        if self._early:
            text = f'{len(self._early)} messages wait in memory for the first /clock, their time'
            self.complain('early', text)

    def _path(self, values: Mapping[str, Any]) -> Path:
        # Recorders of several actuators begin at the same moment.
        kind = 'bag' + self.get_namespace().rstrip('/').replace('/', '_')
        path = Path(values['bag']) if values['bag'] else folders.unnamed(kind)
        return path if self._bags == 0 else path.with_name(f'{path.name}_{self._bags + 1}')

    def _record(self, topic: topics.Topic) -> None:
        """Declare and subscribe to a topic, once; one that cannot be recorded is reported."""
        assert self.writer is not None
        name = self.resolve_topic_name(topic.name)
        if name in self._heard:
            return
        kind = type_name(topic.type)
        try:
            self.writer.add_topic(name, kind, qos=(LATCHED if topic.latched else Qos(),))
        except InputError as error:
            self.complain('topic', str(error))
            return
        self._listen(name, topic)

    def _listen(self, name: str, topic: topics.Topic, *, overrides: bool = True) -> None:
        made = self.subscribe(
            topic,
            lambda *found: self._take(name, *found),
            info=True,
            raw=True,
            overrides=overrides,
        )
        self._heard[name] = topic, made

    def _look(self) -> None:
        """Subscribe to further topics that have appeared; adapt to what publishers offer."""
        self._release_early()
        for name, types in self.get_topic_names_and_types() if self._wanted else ():
            for wanted in [w for w in self._wanted if self.resolve_topic_name(w) == name]:
                self._wanted.discard(wanted)
                qos = _suited(topics.SAMPLES.qos, self._offered(name, types[0]))
                try:
                    self._record(topics.Topic(wanted, _message(types[0]), qos, shared=True))
                except (ImportError, AttributeError) as error:
                    self.complain('topic', f'{name}: type {types[0]} is not installed ({error})')
        for name, (topic, made) in list(self._heard.items()):
            offered = self._offered(name, type_name(topic.type))
            if any(refusal(made.qos_profile, one) for one in offered):
                self._take_from(made)
                self.unsubscribe(made)
                qos = _suited(made.qos_profile, offered)
                self._listen(name, replace(topic, qos=qos), overrides=False)
                self.get_logger().info(
                    f'{name}: a publisher offers less than was asked for; recorded '
                    f'{qos.reliability.name.lower()}, {qos.durability.name.lower()} from here on'
                )

    def _offered(self, name: str, kind: str) -> list[QoSProfile]:
        """Return the QoS of each publisher of a topic that has the type."""
        found = self.get_publishers_info_by_topic(name)
        return [info.qos_profile for info in found if info.topic_type == kind]

    def _take_what_waits(self) -> None:
        """Take what has reached this process but not yet its callbacks, in the suite's order."""
        for _, made in self._heard.values():
            self._take_from(made)

    def _take_from(self, made: Any) -> None:
        for _ in range(made.qos_profile.depth):
            found = made.handle.take_message(made.msg_type, True)
            if found is None:
                return
            self._take(made.topic_name, *found)

    def _take(self, name: str, data: bytes, info: Mapping[str, Any]) -> None:
        self.received.add()
        if self._waiting_bytes + len(data) > self.parameters['max_waiting']:
            self._lost += 1
            why = 'the disk stalls or is full' if begun(self.get_clock()) else 'no /clock has come'
            self.complain('lost', f'{why}: {self._lost} messages lost', ERROR)
            return
        self._waiting_bytes += len(data)
        now = self.get_clock().now().nanoseconds or None
        item = Item(name, data, now, info['source_timestamp'] or None, time.monotonic())
        if now is None:
            self._early.append(item)
            return
        self._release_early()
        self._queue.put(item)

    def _release_early(self, last: bool = False) -> None:
        """Record what came before the first /clock, with the time that this gives.

        Args:
            last: the clock is waited for no longer: where it has not begun, the time of each
                message is that of its publisher's computer.
        """
        count, now = len(self._early), self.get_clock().now().nanoseconds
        if not count or not (now or last):
            return
        for item in self._early:
            self._queue.put(item._replace(received=now or item.published or time.time_ns()))
        self._early.clear()
        self.get_logger().warning(
            f'{count} messages came before the first /clock; recorded at '
            + ('the time that it says' if now else "the computer's time, for it never came")
        )

    def _write(self) -> None:
        """Write what arrives until None arrives; runs in its own thread."""
        writer = self.writer
        assert writer is not None
        while True:
            try:
                item = self._queue.get(timeout=0.05)
            except queue.Empty:
                item = Item('', b'', 0, 0, time.monotonic())
            if item is None:
                return
            if self._failed and self._finished.is_set():
                self._lost += bool(item.topic)  # the disk was waited for long enough
                continue
            try:
                if item.topic:
                    assert item.received is not None
                    writer.write_raw(item.topic, item.data, item.received, item.published)
                else:
                    writer.flush_if_due()
            except DiskError as error:
                self._wait_for_disk(writer, error)
            except Exception as error:  # the thread outlives any message
                self._lost += 1
                text = f'a message of {item.topic} cannot be recorded: {error or type(error)}'
                self.complain('message', text, ERROR)
            self._waiting_bytes -= len(item.data)
            self._lag = time.monotonic() - item.arrived
            self._worst_lag = max(self._worst_lag, self._lag)

    def _wait_for_disk(self, writer: BagWriter, failure: DiskError) -> None:
        """Wait until the disk takes messages again, or the bag is to be finished."""
        began, self._failed = time.monotonic(), str(failure)
        while True:
            over = self._finished.wait(RETRY_PERIOD)
            try:
                writer.flush()
            except DiskError as error:
                self._failed = str(error)
                if over:
                    return
            else:
                break
        self._failed = ''
        seconds = time.monotonic() - began
        self.get_logger().warning(
            f'the disk takes messages again after {seconds:.1f} s; {self._lost} are lost so far'
        )

    def _sync(self) -> None:
        """Have the disk take what was written; a thread of its own, for a disk may take long."""
        writer, finished = self.writer, self._finished
        assert writer is not None
        while not finished.wait(SYNC_PERIOD):
            try:
                writer.sync()
                self._unsynced = ''
            except InputError as error:
                self._unsynced = str(error)


def _suited(asked: QoSProfile, offered: Sequence[QoSProfile]) -> QoSProfile:
    """Return a profile that hears every publisher, and asks for the most that all offer."""
    reliable = all(o.reliability == ReliabilityPolicy.RELIABLE for o in offered)
    latched = offered and all(o.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offered)
    return QoSProfile(
        history=asked.history,
        depth=asked.depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _message(kind: str) -> Any:
    package, _, name = kind.split('/')
    return getattr(importlib.import_module(f'{package}.msg'), name)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(RecorderNode, args)


if __name__ == '__main__':
    sys.exit(main())
