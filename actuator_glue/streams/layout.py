"""Layouts of streams: what a controller's packets, lines or channels hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.io.units import FLOAT32_COUNTS, ROLES, common_motion, of_file
from actuator_glue.records import Array, Hold

TYPES = {
    'float64': 'f8',
    'double': 'f8',
    'float32': 'f4',
    'single': 'f4',
    'float': 'f4',
    'int8': 'i1',
    'int16': 'i2',
    'int32': 'i4',
    'int64': 'i8',
    'uint8': 'u1',
    'uint16': 'u2',
    'uint32': 'u4',
    'uint64': 'u8',
}


@dataclass(frozen=True, slots=True)
class Field:
    """One value of a packet, line or channel.

    Attributes:
        name: command, measured, force, time or counter; any other is stepped over.
        type: how it is packed; text and LSL need none.
        unit: unit of the value after scaling; none for a counter.
        scale: factor from the value sent to `unit`.
        offset: value in `unit` added after scaling.
        count: how many such values follow each other, for those stepped over.
        column: name, or number from 1, of the column; None for the place in the list.
    """

    name: str
    type: str = 'float64'
    unit: str | None = None
    scale: float = 1.0
    offset: float = 0.0
    count: int = 1
    column: str | int | None = None

    @property
    def role(self) -> bool:
        """Whether it is more than stepped over."""
        return self.name in ROLES or self.name == 'counter'

    def si(self, values: NDArray[Any]) -> Array:
        """Return values as sent in SI units, or in what stands for them (`motion`)."""
        gain = of_file(self.name, self.unit, self.name)
        return (np.asarray(values, dtype=np.float64) * self.scale + self.offset) * gain

    def sent(self, values: Array) -> Array:
        """Return values in SI units as they are sent."""
        gain = of_file(self.name, self.unit, self.name)
        return (values / gain - self.offset) / self.scale


class Rows(NamedTuple):
    """Samples as they arrived, in SI units, unordered.

    Attributes:
        command: shape (n,) [m].
        measured: shape (n,) [m].
        force: shape (n,) [N], or None.
        counter: running number of each as sent, shape (n,), or None.
        time: sender's time of each, shape (n,) [s], or None.
        arrival_ns: when the last of them came, by the receiver's clock [ns].
        fresh: a connection begins with them; earlier samples are not known.
    """

    command: Array
    measured: Array
    force: Array | None
    counter: NDArray[np.int64] | None
    time: Array | None
    arrival_ns: int
    fresh: bool = False


@dataclass(frozen=True, slots=True)
class Layout:
    """What a stream's messages hold.

    Attributes:
        sample: values of one sample, in order.
        packet: values once per packet, before its samples; counter and time of the first sample.
        samples: samples per packet.
        counts: what a counter in `packet` counts: packets or samples.
        byte_order: of packed values, little or big.
        delimiter: between the columns of a line.
        header: whether the first line of a connection names the columns.
        rate: sample rate [Hz].
        hold: how the command runs between its samples, zoh or linear.
        stiffness: specimen stiffness [N/m].
        actuator: name of the actuator.
        forward: HOST:PORT of the site behind a shadow of OpenFresco.
        source: the layout's file, for messages.
    """

    sample: tuple[Field, ...]
    packet: tuple[Field, ...] = ()
    samples: int = 1
    counts: Literal['packets', 'samples'] = 'packets'
    byte_order: Literal['little', 'big'] = 'little'
    delimiter: str = ','
    header: bool = False
    rate: float | None = None
    hold: Hold | None = None
    stiffness: float | None = None
    actuator: str = 'actuator'
    forward: str = ''
    source: str = ''

    @property
    def fields(self) -> dict[str, Field]:
        """Fields that are more than stepped over, by name."""
        return {f.name: f for f in (*self.packet, *self.sample) if f.role}

    @property
    def motion(self) -> str:
        """What command and measured are in: metres, or another motion.

        Raises:
            InputError: two that differ, or a torque where nothing turns.
        """
        return common_motion(
            {name: field.unit or '' for name, field in self.fields.items()},
            f'{self.source}: layout',
        )

    @property
    def modulus(self) -> int | None:
        """Samples after which the counter begins again by its type; None where it does not."""
        counter = self.fields.get('counter')
        if counter is None or TYPES[counter.type][0] == 'f':
            return None
        step = self.samples if counter in self.packet and self.counts == 'packets' else 1
        bits = 8 * int(TYPES[counter.type][1])
        return step << bits if bits < 64 else None

    def coarse(self, name: str, values: NDArray[Any], rate: float) -> NDArray[np.bool_]:
        """Return which counters or times tell no sample from the next, shape (n,).

        A float32 counts to 2^24, and its times of hours are apart by more than half a sample.

        Args:
            name: counter or time.
            values: as sent, shape (n,).
            rate: sample rate [Hz].
        """
        field = self.fields[name]
        if 'f4' not in (TYPES[field.type], f'{values.dtype.kind}{values.dtype.itemsize}'):
            return np.zeros(len(values), dtype=bool)
        every = self.samples if field in self.packet else 1
        if name == 'counter':
            limit = FLOAT32_COUNTS * (every if self.counts == 'packets' else 1)
            return np.asarray(np.abs(values) >= limit)
        step = np.spacing(np.abs(values).astype(np.float32)).astype(np.float64)
        return np.asarray(field.si(step) - field.si(np.zeros(1)) > 0.5 * every / rate)

    def rows(
        self, values: Mapping[str, NDArray[Any]], arrival_ns: int, rate: float, fresh: bool = False
    ) -> tuple[Rows, Counter[str]]:
        """Return samples in SI units, and how many have a fault, by its name.

        Left out: `malformed`, what tells the order (counter, else time) is no number; `coarse`, it
        is a float32 that no longer tells one sample from the next. Kept: `untimed`, the counter is
        good and the time no number, which is NaN then.

        Args:
            values: by field, as sent, each of shape (n,).
            arrival_ns: when the last one came [ns].
            rate: sample rate [Hz].
            fresh: whether a connection begins with them.
        """
        good = np.ones(len(values['command']), dtype=bool)
        counter = values.get('counter')
        with np.errstate(all='ignore'):
            if counter is not None and counter.dtype.kind == 'f':
                good &= np.abs(counter) < 2.0**53  # NaN compares as False
            si = {n: f.si(values[n]) for n, f in self.fields.items() if n != 'counter'}
            untimed = np.zeros(len(good), dtype=bool)
            if 'time' in si:
                timed = np.abs(si['time']) < 1e11
                if counter is None:
                    good &= timed
                else:
                    untimed = good & ~timed
                    si['time'] = np.where(timed, si['time'], np.nan)
            order = next((n for n in ('counter', 'time') if n in self.fields), None)
            coarse = good & self.coarse(order, values[order], rate) if order else ~good
        left_out = Counter(malformed=int((~good).sum()), coarse=int((coarse & good).sum()))
        good &= ~coarse
        left_out['untimed'] = int((untimed & good).sum())
        if not good.all():
            si = {name: column[good] for name, column in si.items()}
            counter = None if counter is None else counter[good]
        return Rows(
            si['command'],
            si['measured'],
            si.get('force'),
            None if counter is None else counter.astype(np.int64),
            si.get('time'),
            arrival_ns,
            fresh,
        ), left_out


# What `send` sends and lab_bridge expects where no layout is given.
PLAIN = Layout(
    sample=(
        Field('counter', 'uint32'),
        Field('time', unit='s'),
        Field('command', unit='m'),
        Field('measured', unit='m'),
        Field('force', unit='N'),
    )
)
