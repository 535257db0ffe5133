"""A laboratory file or bag, published as if it were being measured."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.io.load import load_records
from actuator_glue.nodes import spin, streamer
from actuator_glue.nodes.blocks import BlockPublisher
from actuator_glue.nodes.pacer import Step
from actuator_glue.nodes.parameters import Spec
from actuator_glue.records import Record

SPECS = (
    Spec('file', '', 'laboratory file or bag', read_only=True),
    Spec('channels', '', 'channel map of the file (YAML)', read_only=True),
    Spec(
        'specimen_stiffness', -1.0, 'specimen stiffness k, -1 for what the file says',
        'N/m', -1.0, 1e12, True,
    ),
    Spec(
        'hold', 'file', 'how the command runs between its samples', read_only=True,
        choices=('file', 'zoh', 'linear'),
    ),
    Spec('actuator', '', 'name of the actuator, empty for what the file says', read_only=True),
    Spec('block', 10, 'samples per message', '1', 1, 100_000, True),
    Spec('preview', 0.0, 'how far ahead commands are published, 0 for not', 's', 0.0, 60.0, True),
    *streamer.specs(exit_at_end=True),
)  # fmt: skip


class LabBridgeNode(streamer.Streamer):
    """Publishes the samples of a file at their own rate, or faster."""

    def __init__(self) -> None:
        super().__init__('lab_bridge', SPECS)

    def check(self, values: Mapping[str, Any]) -> None:
        """A stiffness is -1 or not negative."""
        if -1.0 < values['specimen_stiffness'] < 0.0:
            raise InputError(
                f'specimen_stiffness {values["specimen_stiffness"]:g} N/m is negative; give it in '
                'N/m, or -1 for what the file says'
            )

    def do_configure(self) -> None:
        """Read the whole file, so that what is wrong with it is said before a test begins."""
        values = self.parameters.values()
        if not values['file']:
            raise InputError('parameter file is empty; give a laboratory file or a bag')
        given = values['specimen_stiffness']
        self.records = load_records(
            values['file'],
            channels=values['channels'] or None,
            stiffness=None if given < 0.0 else given,
            hold=None if values['hold'] == 'file' else values['hold'],
            note=lambda text: self.complain('file', text),
            gap=lambda text: self.complain('file', text),
        )
        if values['actuator']:
            self.records = [replace(r, actuator=values['actuator']) for r in self.records]
        for record in self.records:
            known = 'not known' if record.stiffness is None else f'{record.stiffness:g} N/m'
            self.get_logger().info(
                f'{record.source}: {len(record)} samples at {record.rate:g} Hz, '
                f'specimen stiffness {known}'
            )
        self.out = BlockPublisher(self.publisher)

    def stream(self) -> Iterator[Step]:
        """Yield the blocks of all records, one record after another."""
        offset = 0.0
        for record in self.records:
            yield from self._record(record, offset)
            offset += record.duration

    def _record(self, record: Record, offset: float) -> Iterator[Step]:
        size = self.parameters['block']
        ahead = round(self.parameters['preview'] * record.rate)
        self._start_clock(record)
        self.out.setup(record.stiffness, record.hold, record.first_index, record.source)
        if not offset:
            self.introduce()
            self._start_clock(record)
        for start in range(0, len(record), size):
            stop = min(start + size, len(record))
            due = offset + stop * record.period
            yield Step(due, partial(self._publish, record, start, stop, ahead))

    def _start_clock(self, record: Record) -> None:
        now = self.get_clock().now().nanoseconds
        self.out.begin(record.actuator, record.period, now, record.first_index)

    def _publish(self, record: Record, start: int, stop: int, ahead: int) -> None:
        first = 0 if start == 0 else min(start + ahead, len(record))
        last = min(stop + ahead, len(record))
        if ahead and last > first:
            self.out.preview(record.first_index + first, record.command[first:last])
        part = slice(start, stop)
        force = None if record.force is None else record.force[part]
        self.out.samples(
            record.first_index + start, record.command[part], record.measured[part], force
        )
        self.samples.add(stop - start)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return spin.main(LabBridgeNode, args)


if __name__ == '__main__':
    sys.exit(main())
