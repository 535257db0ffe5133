"""What lab_bridge plays: the records of a laboratory file or bag."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.io.load import load_records
from actuator_glue.nodes.blocks import BlockPublisher
from actuator_glue.nodes.pacer import Step
from actuator_glue.nodes.streamer import Streamer
from actuator_glue.records import Record


class FileSource:
    """Records at their own rate; the whole file is read at once, so that its faults are known.

    Args:
        node: who publishes.
        values: its parameters.
        out: where samples go.

    Raises:
        InputError: no file, or one that cannot be used.
    """

    def __init__(self, node: Streamer, values: Mapping[str, Any], out: BlockPublisher) -> None:
        if not values['file']:
            raise InputError(
                'parameters file and source are empty; give a laboratory file or a bag, or a '
                'source such as udp://127.0.0.1:5005'
            )
        self._node, self._values, self._out = node, values, out
        given = values['specimen_stiffness']
        told: Callable[[str], None] = partial(node.complain, 'file')
        records = load_records(
            values['file'],
            channels=values['channels'] or None,
            stiffness=None if given < 0.0 else given,
            hold=None if values['hold'] == 'file' else values['hold'],
            note=told,
            gap=told,
        )
        if values['actuator']:
            records = [replace(r, actuator=values['actuator']) for r in records]
        self._records = records
        self._clock_changed = False

    def described(self) -> list[str]:
        """Return a line per record."""
        return [
            f'{r.source}: {len(r)} samples at {r.rate:g} Hz, specimen stiffness '
            + ('not known' if r.stiffness is None else f'{r.stiffness:g} N/m')
            for r in self._records
        ]

    def steps(self) -> Iterator[Step]:
        """Yield the blocks of all records, one record after another."""
        offset = 0.0
        for record in self._records:
            yield from self._record(record, offset)
            offset += record.duration

    def report(self) -> dict[str, Any]:
        """Return nothing beyond what every stream reports."""
        return {}

    def close(self) -> None:
        """Nothing is held."""

    def clock_jumped(self) -> None:
        """Stamps go on from the new time."""
        self._clock_changed = True

    def _record(self, record: Record, offset: float) -> Iterator[Step]:
        size = self._values['block']
        ahead = round(self._values['preview'] * record.rate)
        self._start_clock(record, record.first_index)
        self._out.setup(
            record.stiffness, record.hold, record.first_index, record.source, record.motion
        )
        if not offset:
            self._node.introduce()
            self._start_clock(record, record.first_index)
        for start in range(0, len(record), size):
            stop = min(start + size, len(record))
            due = offset + stop * record.period
            yield Step(due, partial(self._publish, record, start, stop, ahead))

    def _start_clock(self, record: Record, index: int, taken: int = 0) -> None:
        """Have the next samples stamped by the clock as it is now: so many have been taken."""
        self._clock_changed = False
        start = self._node.get_clock().now().nanoseconds - round(1e9 * taken * record.period)
        self._out.begin(record.actuator, record.period, start, index)

    def _publish(self, record: Record, start: int, stop: int, ahead: int) -> None:
        if self._clock_changed:
            self._start_clock(record, record.first_index + start, stop - start)
        first = 0 if start == 0 else min(start + ahead, len(record))
        last = min(stop + ahead, len(record))
        if ahead and last > first:
            self._out.preview(record.first_index + first, record.command[first:last])
        part = slice(start, stop)
        force = None if record.force is None else record.force[part]
        self._out.samples(
            record.first_index + start, record.command[part], record.measured[part], force
        )
        self._node.samples.add(stop - start)
