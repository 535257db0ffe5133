"""A record sent as a controller would send it: packet by packet, on time."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array, Record, same_period
from actuator_glue.streams.layout import Layout
from actuator_glue.streams.transports import Sender

# Later than this is late [s].
LATE = 5e-3
# Samples encoded at once while none is due.
_AHEAD = 2048


@dataclass(slots=True)
class Sent:
    """What was sent.

    Attributes:
        samples: samples.
        messages: datagrams, lines or samples of LSL.
        seconds: how long it took [s].
        late: times the sender woke more than 5 ms after a packet was due.
        latest: the worst of these [s].
    """

    samples: int = 0
    messages: int = 0
    seconds: float = 0.0
    late: int = 0
    latest: float = 0.0


def check(record: Record, layout: Layout) -> None:
    """Refuse a record that a layout cannot carry.

    Raises:
        InputError: another rate or motion, no force where one is to be sent.
    """
    if record.motion != layout.motion:
        raise InputError(
            f'{record.source}: its motion is in {record.motion}, and '
            f'{layout.source or "a packet without a layout"} carries {layout.motion}; give a '
            f'layout in which command and measured have `unit: {record.motion}`'
        )
    if layout.rate is not None and not same_period(record.rate, layout.rate):
        raise InputError(
            f'{record.source}: {record.rate:g} Hz, but {layout.source} says {layout.rate:g} Hz; '
            f'write `rate: {record.rate:g}` there, or send a record of that rate'
        )
    if 'force' in layout.fields and record.force is None and layout.source:
        raise InputError(f'{record.source}: no force, but {layout.source} has one')


def play(
    record: Record,
    layout: Layout,
    sender: Sender,
    speed: float = 1.0,
    progress: Callable[[float], None] = lambda _: None,
) -> Sent:
    """Send a record; what is late is sent at once, nothing is left out.

    Args:
        record: what to send.
        layout: how a sample is sent.
        sender: where to.
        speed: record seconds per second, 0 for as fast as possible.
        progress: told the share that has been sent.

    Raises:
        InputError: as `check`, or the other side has gone.
    """
    check(record, layout)
    sent = Sent()
    many = layout.samples
    rate = record.rate * speed
    start = time.monotonic()
    total = len(record) // many * many
    while sent.samples < total:
        at = sent.samples
        stop = min(at + _AHEAD, total)
        if speed > 0.0:
            # A packet can be sent when its last sample has been taken.
            wait = start + (at + many) / rate - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            elif wait < -LATE:
                sent.late += 1
                sent.latest = max(sent.latest, -wait)
            due = int((time.monotonic() - start) * rate) // many * many
            stop = min(max(due, at + many), stop)
        sent.messages += sender.send(_values(record, at, stop))
        sent.samples = stop
        progress(stop / total)
    sent.seconds = time.monotonic() - start
    return sent


def _values(record: Record, start: int, stop: int) -> dict[str, Array]:
    index = np.arange(start, stop, dtype=np.float64)
    return {
        'counter': index,
        'time': index * record.period,
        'command': record.command[start:stop],
        'measured': record.measured[start:stop],
        'force': np.zeros(stop - start) if record.force is None else record.force[start:stop],
    }
