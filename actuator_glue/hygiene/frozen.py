"""Readings that stand still although the piston must move.

A converter that hangs, or a packet that is sent again, repeats one value exactly. A piston that
play or friction holds still does not: what a model then misses is part of its whole residual, and
a channel's grid holds it for one step at most. A reading that is never exceeded is an end of the
channel's range: that is the transducer's, and stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.records import Array, Record

_REPEATS = 3  # equal readings at least
_BEYOND = 8.0  # times the residual's robust size
_STEPS = 2.0  # of the channel's grid


@dataclass(frozen=True)
class Frozen:
    """Stretches of one record, first and last repeated sample of each, (c,)."""

    first: NDArray[np.intp]
    last: NDArray[np.intp]


def repeats(values: Array) -> Frozen:
    """Return where a channel (n,) repeats a reading, often enough to ask whether it is frozen."""
    same = np.concatenate([[False], values[1:] == values[:-1], [False]])
    first, last = np.flatnonzero(same[1:] != same[:-1]).reshape(-1, 2).T
    long = last - first >= _REPEATS - 1
    return Frozen(first[long] + 1, last[long])


def while_moving(repeated: Frozen, record: Record, output: Array) -> Frozen:
    """Return those repeats in which a model's output moves beyond noise and grid.

    Args:
        repeated: see `repeats`; one at least.
        record: as it was sampled.
        output: of a model that was fitted, at the same times, (n,) [m].
    """
    y, first, last = record.measured, repeated.first - 1, repeated.last
    off = y - output
    noise = 1.4826 * float(np.median(np.abs(off - np.median(off))))
    steps = np.abs(np.diff(y))
    grid = float(steps[steps > 0.0].min(initial=np.inf))
    edges = np.stack([first, last + 1], axis=1).ravel()
    edges = edges[edges < len(y)]
    motion = np.maximum.reduceat(output, edges) - np.minimum.reduceat(output, edges)
    far = motion[::2] > max(_BEYOND * noise, _STEPS * grid)
    far &= (y[last] > y.min()) & (y[last] < y.max())  # else it is at an end of its range
    return Frozen(repeated.first[far], last[far])


def bridged(record: Record, found: Frozen, output: Array, samples_each: int = 1) -> Array:
    """Return the measured channel (n,) [m] with the motion of a model in place of repeats.

    The error of the model on both sides is interpolated by a line and added.

    Args:
        record: one sample for `samples_each` of the record that was searched (means of twice as
            many).
        found: see `while_moving`.
        output: of the model, (n,) [m].
        samples_each: how many samples were made one.
    """
    out = np.zeros(len(record), dtype=np.bool_)
    reach = 0 if samples_each == 1 else 1
    for first, last in zip(found.first, found.last, strict=True):
        out[max(0, first // samples_each - reach) : last // samples_each + 1 + reach] = True
    if out.all() or not out.any():
        return record.measured
    at = np.arange(len(record))
    off = record.measured - output
    return np.where(out, output + np.interp(at, at[~out], off[~out]), record.measured)
