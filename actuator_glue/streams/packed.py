"""Packed values: the bytes of datagrams to columns, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.records import Array
from actuator_glue.streams.layout import TYPES, Field, Layout


class Packed:
    """Packets of one layout.

    Args:
        layout: what a packet holds.
        rate: sample rate [Hz], for times of a packet that has several samples.
    """

    def __init__(self, layout: Layout, rate: float) -> None:
        self._layout = layout
        self._rate = rate
        order = '<' if layout.byte_order == 'little' else '>'
        sample = _dtype(layout.sample, order)
        self._dtype = np.dtype(
            [*_entries(layout.packet, order, 'p'), ('sample', sample, (layout.samples,))]
        )
        self._places = {f.name: f's{i}' for i, f in enumerate(layout.sample) if f.role}
        self._heads = {f.name: f'p{i}' for i, f in enumerate(layout.packet) if f.role}

    @property
    def size(self) -> int:
        """Bytes of a packet."""
        return self._dtype.itemsize

    def decoded(self, data: bytes) -> dict[str, NDArray[Any]]:
        """Return the values of whole packets by field, as sent, shape (samples of all,)."""
        packets = np.frombuffer(data, self._dtype)
        many = self._layout.samples
        rows = packets['sample'].reshape(-1)
        found: dict[str, NDArray[Any]] = {n: rows[at] for n, at in self._places.items()}
        within = np.tile(np.arange(many), len(packets))
        for name, at in self._heads.items():
            head = packets[at]
            if name == 'counter':
                # A float stays a float: `Layout.rows` checks whether it is a number.
                wide = head.astype(np.float64 if head.dtype.kind == 'f' else np.int64)
                step = many if self._layout.counts == 'packets' else 1
                with np.errstate(all='ignore'):
                    found[name] = np.repeat(wide * step, many) + within
            else:
                field = self._layout.fields['time']
                step_sent = (field.sent(np.array([1.0 / self._rate])) - field.sent(np.zeros(1)))[0]
                found[name] = np.repeat(head.astype(np.float64), many) + step_sent * within
        return found

    def encoded(self, values: Mapping[str, Array]) -> list[bytes]:
        """Return the packets of consecutive samples; the last may lack samples and is left out.

        Args:
            values: SI units by field, `counter` as whole numbers, each of shape (n,).

        Raises:
            InputError: a value is beyond what its integer type holds.
        """
        many = self._layout.samples
        count = len(values['command']) // many
        packets = np.zeros(count, self._dtype)
        for name, at in self._places.items():
            every = values[name][: count * many].reshape(count, many)
            _put(packets['sample'], at, self._sent(name, every))
        for name, at in self._heads.items():
            first = values[name][: count * many : many]
            counted = name == 'counter' and self._layout.counts == 'packets'
            _put(packets, at, self._sent(name, first // many if counted else first))
        data = packets.tobytes()
        return [data[i : i + self.size] for i in range(0, len(data), self.size)]

    def _sent(self, name: str, values: Array) -> Array:
        if name == 'counter':
            return values  # it wraps as a controller's does
        field = self._layout.fields[name]
        sent = field.sent(values)
        if TYPES[field.type][0] in 'iu' and sent.size:
            limits = np.iinfo(TYPES[field.type])
            beyond = sent[(np.rint(sent) < limits.min) | (np.rint(sent) > limits.max)]
            if beyond.size:
                raise InputError(
                    f'{self._layout.source or "layout"}: {name} is sent as {beyond.flat[0]:g}, '
                    f'which no {field.type} holds; give it another type, unit or scale'
                )
        return sent


def _put(packets: NDArray[Any], at: str, sent: Array) -> None:
    kind = packets[at].dtype
    if kind.kind not in 'iu':
        packets[at] = sent
        return
    # A counter wraps; a value is rounded to its step.
    narrow = np.rint(sent).astype(np.int64).astype(f'u{kind.itemsize}')
    packets[at] = narrow.view(f'{kind.kind}{kind.itemsize}')


def _entries(fields: tuple[Field, ...], order: str, prefix: str) -> list[Any]:
    # Any name may be there twice or be no identifier: places are numbered.
    return [
        (f'{prefix}{i}', order + TYPES[f.type], (f.count,))
        if f.count > 1
        else (f'{prefix}{i}', order + TYPES[f.type])
        for i, f in enumerate(fields)
    ]


def _dtype(fields: tuple[Field, ...], order: str) -> np.dtype[Any]:
    return np.dtype(_entries(fields, order, 's'))
