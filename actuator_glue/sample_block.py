"""Samples as they arrive, from live nodes and from bags alike: SampleBlock messages as `Block`.

Nothing here imports ROS: rclpy's messages and those read from a bag have the same attributes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import MAX_DISPLACEMENT, MAX_FORCE, Array, numbers
from actuator_glue.setups import MAX_INDEX

# A block is a moment of a test; more than this is a file sent by mistake.
MAX_BLOCK = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Consecutive samples of one actuator, SI units; use `checked` on what comes from outside.

    Attributes:
        index: running index of the first sample.
        period: time between samples [s].
        stamp_ns: acquisition time of the first sample [ns].
        command: commanded displacement, shape (n,) [m].
        measured: measured displacement, shape (n,) [m].
        force: measured force, shape (n,) [N], or None.
    """

    index: int
    period: float
    stamp_ns: int
    command: Array
    measured: Array
    force: Array | None = None

    def __len__(self) -> int:
        return len(self.command)

    def part(self, start: int, stop: int) -> Block:
        """Return samples start:stop as a block of its own."""
        if start == 0 and stop == len(self):
            return self
        return Block(
            self.index + start,
            self.period,
            self.stamp_ns + round(start * self.period * 1e9),
            self.command[start:stop],
            self.measured[start:stop],
            None if self.force is None else self.force[start:stop],
        )


def stamp_ns(header: Any) -> int:
    """Return the stamp of a std_msgs/Header [ns]."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def from_message(message: Any) -> Block:
    """Return the block of a SampleBlock, unchecked."""
    command, measured, force = (
        np.asarray(channel, dtype=np.float64)
        for channel in (message.command, message.measured, message.force)
    )
    return Block(
        index=int(message.index),
        period=float(message.period),
        stamp_ns=stamp_ns(message.header),
        command=command,
        measured=measured,
        force=force if len(force) else None,
    )


def check_block(block: Block) -> Block:
    """Return a block that can be used, as it is.

    Raises:
        InputError: empty, channels of different lengths, NaN, a displacement or force no
            laboratory has, an absurd period, or far too many samples.
    """
    where = f'block at sample {block.index}'
    size = len(block.command)
    if len(block.measured) != size or (block.force is not None and len(block.force) != size):
        lengths = {'command': size, 'measured': len(block.measured)}
        lengths |= {} if block.force is None else {'force': len(block.force)}
        raise InputError(f'{where}: channels have different lengths {lengths}')
    if not size:
        raise InputError(f'{where}: it is empty; leave out blocks without samples')
    check_times(block)
    _check_channel(where, block.index, 'command', block.command, 'm', MAX_DISPLACEMENT)
    _check_channel(where, block.index, 'measured', block.measured, 'm', MAX_DISPLACEMENT)
    if block.force is not None:
        _check_channel(where, block.index, 'force', block.force, 'N', MAX_FORCE)
    return block


def check_times(block: Block) -> None:
    """Refuse a block of which nobody can say when its samples were.

    Raises:
        InputError: an absurd period or running index, or far too many samples.
    """
    where = f'block at sample {block.index}'
    if len(block) > MAX_BLOCK:
        raise InputError(f'{where}: {len(block)} samples are more than {MAX_BLOCK}')
    if not 0 <= block.index <= MAX_INDEX:
        raise InputError(f'{where}: the running index is outside [0, {MAX_INDEX}]')
    if not 1e-6 <= block.period <= 10.0:
        raise InputError(f'{where}: period {block.period:g} s is outside [1e-6, 10] s')


def _check_channel(
    where: str, index: int, name: str, values: Array, unit: str, limit: float
) -> None:
    if isinstance(values, np.ma.MaskedArray):
        values = numbers(values)
    # One pass where all is well: a NaN fails the comparison as well.
    if np.abs(values).max() <= limit:
        return
    bad = ~np.isfinite(values)
    if bad.any():
        at = int(bad.argmax())
        raise InputError(f'{where}: {name} is NaN or infinite at sample {index + at}')
    at = int(np.abs(values).argmax())
    raise InputError(
        f'{where}: {name} is {values[at]:g} {unit} at sample {index + at}, beyond '
        f'{limit:g} {unit}; check the unit of this channel'
    )
