"""Free runs of a record, some samples at a time: a long one asks for no memory of its own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.least_squares.decimate import window
from actuator_glue.jit import njit
from actuator_glue.model.exact import Initial
from actuator_glue.model.parameters import Parameter
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

# Which parameter sets (c,), their first sample, and what is shown (n, c), until the next is.
Part = tuple[NDArray[np.intp], int, Array]


class Model(Protocol):
    """What a structure must offer here (see actuator_glue.model.structure.Structure)."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters in the order of theta's columns."""

    def simulate(
        self,
        theta: Array,
        record: Record,
        *,
        initial: Initial = 'rest',
        origin: float = 0.0,
        force: bool = False,
    ) -> Array:
        """Free-run sensor output (m, n) [m] of theta (m, p); the test began `origin` s before.

        Or the actuator force [N].
        """


class ObservedChannel(ABC):
    """A record that shows something else than the displacement (diagnosis/samples/force.py)."""

    __slots__ = ()

    @abstractmethod
    def simulate(self, model: Model, theta: Array, initial: Initial, origin: float) -> Array:
        """What its measured channel shows of theta (m, p), (m, n)."""


def simulated(
    model: Model, theta: Array, record: Record, initial: Initial, origin: float = 0.0
) -> Array:
    """Return what a record's measured channel shows of theta (m, p), free-run, (m, n) [m]."""
    if isinstance(record, ObservedChannel):
        return record.simulate(model, theta, initial, origin)
    return model.simulate(theta, record, initial=initial, origin=origin)


def parts(
    model: Model, theta: Array, record: Record, initial: Initial, origin: float, count: int = 1
) -> Iterator[Part]:
    """Yield what `simulated` returns, part by part, with one sample for `count` of the record."""
    if isinstance(model, Structure) and not isinstance(record, ObservedChannel):
        run = model.stretches(model.table(theta), record, initial, origin=origin)
    else:
        whole = simulated(model, theta, record, initial, origin)
        run = iter([(np.arange(len(theta)), 0, whole.T)])
    return run if count == 1 else _decimated(run, count, len(record))


def _decimated(run: Iterator[Part], count: int, samples: int) -> Iterator[Part]:
    """Yield means of means of `count` samples as `decimate.means` makes them; ends are held."""
    taps, half = window(count), count - 1
    kept, first = np.empty((0, 0)), 0
    for which, begin, y in run:
        if begin == 0:
            kept, first = np.repeat(y[:1], half, axis=0), 0
        last = y[-1:].repeat(half if begin + len(y) == samples else 0, axis=0)
        piece = np.concatenate([kept, y, last])
        n = max(0, (len(piece) - len(taps)) // count + 1)
        out = np.zeros((n, piece.shape[1]))
        _add_filtered(piece, taps, count, out)
        yield which, first, out
        kept, first = piece[n * count :], first + n


@njit(nogil=True)
def _add_filtered(values: Array, taps: Array, count: int, out: Array) -> None:
    """Add to each row of `out` (n, c) the taps' sum over `values` from every `count`-th row on."""
    for i in range(out.shape[0]):
        for k in range(len(taps)):
            tap, row = taps[k], i * count + k
            for n in range(out.shape[1]):
                out[i, n] += tap * values[row, n]
