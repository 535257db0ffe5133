"""Records in bags: SampleBlock and TestSetup messages to `Record` and back."""

from __future__ import annotations

from array import array
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.clock_check import disagreement, rate_by_clock
from actuator_glue.errors import InputError
from actuator_glue.io import bag_samples
from actuator_glue.io.bag_metadata import LATCHED
from actuator_glue.io.bag_publishers import Publishers
from actuator_glue.io.bag_reader import TEST_SETUP, BagMessage, as_published, messages, summarise
from actuator_glue.io.bag_samples import SAMPLE_BLOCK, BagBlock, BagSetup
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.messages import header, message
from actuator_glue.io.remarks import Note, refuse, tell_gap, warn_caller
from actuator_glue.motion import METRES
from actuator_glue.records import Record, same_period
from actuator_glue.sample_block import Block
from actuator_glue.setups import Setups, StreamSetup

CLOCK_TOLERANCE = 0.1  # s; a step between two blocks beyond this is a jump, not jitter
TYPES = (SAMPLE_BLOCK, TEST_SETUP)
BLOCK = 64  # samples per message where nobody says otherwise


@dataclass(slots=True)
class _Segment:
    """Blocks that follow each other without a gap, under one set-up."""

    topic: str
    actuator: str
    first: Block
    setup: StreamSetup | None
    command: array[float] = field(default_factory=lambda: array('d'))
    measured: array[float] = field(default_factory=lambda: array('d'))
    force: array[float] = field(default_factory=lambda: array('d'))
    # Where each block begins, and its stamp since that of the first [s].
    begins: array[int] = field(default_factory=lambda: array('q'))
    stamps: array[float] = field(default_factory=lambda: array('d'))
    next_stamp: int = 0

    @property
    def next_index(self) -> int:
        return self.first.index + len(self.command)

    def append(self, block: Block) -> None:
        self.begins.append(block.index)
        self.stamps.append((block.stamp_ns - self.first.stamp_ns) * 1e-9)
        self.next_stamp = block.stamp_ns + round(len(block) * block.period * 1e9)
        self.command.frombytes(block.command.tobytes())
        self.measured.frombytes(block.measured.tobytes())
        if block.force is not None:
            self.force.frombytes(block.force.tobytes())

    def fault_before(self, block: Block) -> str:
        """Return what went wrong between this segment and a block, empty where nothing did."""
        at = f'at sample {block.index}'
        if block.index > self.next_index:
            missing = block.index - self.next_index
            seconds = f'{missing * block.period:.3g} s'
            return f'{missing} samples ({seconds}) are missing before sample {block.index}'
        if block.index < self.next_index:
            # A new test begins at 0, and may have a clock of its own.
            again = f'the stream begins again {at} after sample {self.next_index - 1}'
            return again if block.index else ''
        jump = (block.stamp_ns - self.next_stamp) * 1e-9
        if abs(jump) > CLOCK_TOLERANCE:
            return f'the clock jumps by {jump:.3g} s {at}'
        return ''

    def same_test(self, block: Block, setup: StreamSetup | None) -> bool:
        """Whether a block belongs to the same test: it goes on under the same set-up."""
        return (
            block.index == self.next_index
            and same_period(block.period, self.first.period)
            and (block.force is None) == (self.first.force is None)
            and _test(setup) == _test(self.setup)
        )

    def record(self, source: str) -> Record:
        """Return the samples as a record.

        Raises:
            InputError: they cannot be one, or their stamps tell another sample rate.
        """
        setup, rate = self.setup, 1.0 / self.first.period
        found = rate_by_clock(self.begins, self.stamps, rate)
        if found is not None:
            told = disagreement(rate, {'the stamps of the samples': found})
            raise InputError(
                f'{source}: {told}; one of them is wrong, and with it every result in seconds: '
                'mend the rate of whoever published the samples, and record again'
            )
        return Record(
            command=np.array(self.command),
            measured=np.array(self.measured),
            force=np.array(self.force) if self.first.force is not None else None,
            period=self.first.period,
            stiffness=setup.stiffness if setup else None,
            hold=setup.hold if setup else 'zoh',
            actuator=self.actuator or (setup.actuator if setup else '') or 'actuator',
            start_ns=self.first.stamp_ns,
            first_index=self.first.index,
            source=source,
            motion=setup.motion if setup else METRES,
        )


def _test(setup: StreamSetup | None) -> tuple[object, ...]:
    return (setup.stiffness, setup.hold, setup.actuator, setup.motion) if setup else ()


def read_records(
    path: Path | str, *, note: Note = refuse, gap: Note | None = None, warn: Note = warn_caller
) -> list[Record]:
    """Return the records of a bag, one per topic and stretch without a gap.

    Args:
        path: bag folder or lone .mcap.
        note: called with one line per damage; the default raises it.
        gap: called with one line where samples are missing or the clock jumps, and the test is
            split there, and where publishers take turns, whose samples are left out; the default
            raises. A new test or set-up splits without a word.
        warn: called with one line per set-up that cannot be used; the default is a Python
            warning.

    Raises:
        InputError: no bag, no samples, NaN or absurd samples; damage without `note`, or a gap or
            clock jump without `gap`.
    """
    every, setups = _setups(path, note, warn)
    open_segments: dict[str, _Segment | None] = {}
    done: list[_Segment] = []
    publishers: dict[str, Publishers] = {}
    for number, (topic, actuator, block), setup in _governed(path, every(), setups):
        segment = open_segments.get(topic)
        fault = segment.fault_before(block) if segment is not None else ''
        breaks = segment is not None and (fault != '' or block.index < segment.next_index)
        if breaks and topic not in publishers:
            publishers[topic] = _publishers(path, every(), topic)
            if told := publishers[topic].told:
                tell_gap(
                    f'{path}: topic {topic}: {told}', gap, 'what they sent in turn is left out'
                )
        in_turn = topic in publishers and publishers[topic].in_turn(number)
        if fault and not in_turn:
            tell_gap(f'{path}: topic {topic}: {fault}', gap)
        if segment is not None and (in_turn or fault or not segment.same_test(block, setup)):
            done.append(segment)
            segment = None
        if segment is None and not in_turn:
            segment = _Segment(topic, actuator, block, setup)
        open_segments[topic] = segment
        if segment is not None:
            segment.append(block)
    done.extend(segment for segment in open_segments.values() if segment is not None)
    long_enough = [segment for segment in done if len(segment.command) >= 2]
    records = [
        segment.record(
            (f'{path}:{segment.topic}' if len(open_segments) > 1 else str(path))
            + (f' (record {i} of {len(long_enough)})' if len(long_enough) > 1 else '')
        )
        for i, segment in enumerate(long_enough, start=1)
    ]
    if not records:
        raise InputError(without_samples(path))
    return records


def _publishers(path: Path | str, every: Iterable[BagMessage], topic: str) -> Publishers:
    """Return what all blocks of a topic say of its publishers."""
    found = Publishers()
    for raw in every:
        if raw.topic == topic:
            found.take(bag_samples.samples(raw, path).block)
    return found


def without_samples(path: Path | str) -> str:
    """Return what a bag without samples of ours holds, and how it is read."""
    held = [f'{t.name} ({t.type}, {t.count})' for t in summarise(path).topics.values()]
    return (
        f'{path}: no two samples of {SAMPLE_BLOCK} in this bag; it holds '
        f'{", ".join(held) or "no message"}; `actuator-glue map {path}` proposes a channel map '
        'where these are the channels'
    )


def _governed(
    path: Path | str, every: Iterable[BagMessage], setups: list[tuple[int, BagSetup]]
) -> Iterator[tuple[int, BagBlock, StreamSetup | None]]:
    """Yield all samples in their order, each block or part of a block with its set-up.

    Before each stands the number of the block, counted from 0 on its topic.
    """
    governing: dict[str, _Governing] = {}
    blocks: Counter[str] = Counter()
    for place, raw in enumerate(every):
        if raw.type == SAMPLE_BLOCK:
            found = bag_samples.samples(raw, path)
            if found.topic not in governing:
                governing[found.topic] = _Governing(found.topic, setups)
            for block, setup in governing[found.topic].parts(found.block, place):
                yield blocks[found.topic], found._replace(block=block), setup
            blocks[found.topic] += 1


def check_order(path: Path | str) -> None:
    """Refuse a bag whose file holds messages in another order than that of their times.

    `read_records` puts records in order; a replay of a live run takes messages as they came.

    Raises:
        InputError: the order differs; the message says what to do.
    """
    order = _Order(path)
    for _ in order.seen(_again(path)):
        if order.mixed:
            break
    if order.mixed and _by_time(path) is not None:
        raise InputError(
            f'{path}: its messages are not in the order of their times; put the samples in order '
            f'with `actuator-glue convert {path} OUT`'
        )


def _setups(
    path: Path | str, note: Note, warn: Note
) -> tuple[Callable[[], Iterable[BagMessage]], list[tuple[int, BagSetup]]]:
    """Return what gives all messages, and the usable set-ups with their place among them.

    Checks the whole bag. A set-up that cannot be used is left out, as a live node leaves it out.
    Messages that a file holds in another order than that of their times are put in order.
    """
    order = _Order(path)
    setups = [*_usable(order.seen(messages(path, types=TYPES, note=note)), path, warn)]
    every = _by_time(path) if order.mixed else None
    if every is not None:
        return lambda: every, [*_usable(every, path, lambda _: None)]
    return lambda: as_published(_again(path)), setups


def _again(path: Path | str) -> Iterator[BagMessage]:
    """Yield messages whose damage has been told."""
    return messages(path, types=TYPES, note=lambda _: None)


def _by_time(path: Path | str) -> list[BagMessage] | None:
    """Return messages in the order of their times; None where samples do not count on in it."""
    every = sorted(_again(path), key=attrgetter('log_time'))
    following: dict[str, int] = {}
    for raw in every:
        if raw.type == SAMPLE_BLOCK:
            block = bag_samples.samples(raw, path).block
            if block.index < following.get(raw.topic, 0):
                return None
            following[raw.topic] = block.index + len(block)
    return every


def _usable(
    every: Iterable[BagMessage], path: Path | str, warn: Note
) -> Iterator[tuple[int, BagSetup]]:
    for place, raw in enumerate(every):
        if raw.type == TEST_SETUP:
            try:
                yield place, bag_samples.setup(raw, path)
            except InputError as error:
                warn(f'{error}; this set-up is not used')


class _Order:
    """Whether a file may hold the blocks of a topic in another order than that of their times.

    Times also go back where a clock is set back, but sample indices then count on, or anew.
    """

    def __init__(self, path: Path | str) -> None:
        self.mixed = False
        self._path = path
        self._last: dict[str, BagMessage] = {}

    def seen(self, every: Iterable[BagMessage]) -> Iterator[BagMessage]:
        """Yield messages as they are, in the order of their publication, and look at them."""
        for raw in as_published(every):
            if raw.type == SAMPLE_BLOCK:
                last = self._last.get(raw.topic)
                self._last[raw.topic] = raw
                if last is not None and raw.log_time < last.log_time:
                    before, now = (bag_samples.samples(m, self._path).block for m in (last, raw))
                    self.mixed |= now.index < before.index and now.stamp_ns < before.stamp_ns
            yield raw


class _Governing:
    """The set-ups of one topic of samples, in the order of their publication.

    Each holds from the sample it names (`Setups`). Topics have no order among each other: a set-up
    recorded after samples for which it holds by its stamp is taken before them.
    """

    def __init__(self, topic: str, setups: list[tuple[int, BagSetup]]) -> None:
        namespace = topic.rpartition('/')[0]
        near = [s for s in setups if s[1].topic.rpartition('/')[0] == namespace] or setups
        # Samples before any set-up belong to the first one.
        self._current = near[0][1].setup if near else None
        self._left = deque(near)
        self._setups = Setups()
        self._stamp_ns = 0
        self._next: int | None = None

    def parts(self, block: Block, place: int) -> Iterator[tuple[Block, StreamSetup | None]]:
        """Yield the parts of a block, at a place among the messages, each with its set-up."""
        last = block.stamp_ns + round((len(block) - 0.5) * block.period * 1e9)
        while self._left and (
            self._left[0][0] < place or self._stamp_ns < self._left[0][1].stamp_ns <= last
        ):
            _, taken = self._left.popleft()
            self._stamp_ns = max(self._stamp_ns, taken.stamp_ns)
            if self._setups.announce(taken.setup, self._next):
                self._current = taken.setup
        for part, begun in self._setups.parts(block.index, len(block), self._next):
            self._current = begun[-1] if begun else self._current
            yield block.part(part.start, part.stop), self._current
        self._next = block.index + len(block)


def write_record(
    writer: BagWriter,
    record: Record,
    *,
    namespace: str = '',
    block: int = BLOCK,
    progress: Callable[[int], None] | None = None,
) -> None:
    """Write one record as TestSetup and SampleBlocks under `NAMESPACE/samples`.

    Args:
        writer: an open bag.
        record: what to write; log times are its own stamps.
        namespace: put before the topics, `` or `/name`.
        block: samples per message.
        progress: called with the number of samples written since the last call.

    Raises:
        InputError: disk full, or a block of less than one sample.
    """
    if block < 1:
        raise InputError(f'a block of {block} samples is impossible; use at least 1')
    samples, setup = f'{namespace}/samples', f'{namespace}/test_setup'
    writer.add_topic(setup, TEST_SETUP, qos=(LATCHED,))
    writer.add_topic(samples, SAMPLE_BLOCK)
    writer.write(setup, _setup_message(record), record.start_ns)
    empty = np.empty(0)
    for start in range(0, len(record), block):
        stop = min(start + block, len(record))
        content = message(
            'SampleBlock',
            header=header(record.stamp_ns(start), record.actuator),
            period=record.period,
            index=record.first_index + start,
            command=record.command[start:stop],
            measured=record.measured[start:stop],
            force=empty if record.force is None else record.force[start:stop],
        )
        # A block is complete, and can be logged, when its last sample has been acquired.
        writer.write(samples, content, record.stamp_ns(stop))
        if progress is not None:
            progress(stop - start)


def _setup_message(record: Record) -> Any:
    return message(
        'TestSetup',
        header=header(record.start_ns, record.actuator),
        actuator=record.actuator,
        specimen_stiffness=float('nan') if record.stiffness is None else record.stiffness,
        rate=record.rate,
        hold=record.hold,
        index=record.first_index,
        source=record.source,
        motion=record.motion,
    )
