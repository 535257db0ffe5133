"""Readings that nobody measured: they stand still, or run straight, where the piston must not.

A converter that hangs, or a packet that is sent again, repeats one value exactly. A piston that
play or friction holds still does not: what a model then misses is part of its whole residual, and
a channel's grid holds it for one step at most. A reading that is never exceeded is an end of the
channel's range: that is the transducer's, and stays. Missing samples that somebody filled in lie
on a straight line, with none of the noise around them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.records import Array, Record

_REPEATS = 3  # equal readings at least
_BEYOND = 8.0  # times the residual's robust size
_DEPARTING = 3.0  # the same from a line, which no noise is
_STEPS = 2.0  # of the channel's grid
_STRAIGHT = 4  # samples on a line at least, between its ends
_BENT = 0.02  # of the usual second difference: noise is as straight once in 10^8 samples


@dataclass(frozen=True)
class Frozen:
    """Stretches of one record that nobody measured, first and last sample of each, (c,)."""

    first: NDArray[np.intp]
    last: NDArray[np.intp]


def repeats(values: Array) -> Frozen:
    """Return where a channel (n,) repeats a reading, often enough to ask whether it is frozen."""
    first, last = _runs(values[1:] == values[:-1])
    long = last - first >= _REPEATS - 2
    return Frozen(first[long] + 1, last[long] + 1)


def lines(values: Array) -> Frozen:
    """Return where a channel (n,) runs on a straight line without noise, from value to value.

    Nowhere, where it does so usually: it is coarse, or was drawn between slower readings.
    """
    bend = np.abs(np.diff(values, 2))
    usual = float(np.median(bend))
    moves = (values[2:] != values[:-2]) & (usual > _STEPS * _grid(values))
    first, last = _runs(moves & (bend <= _BENT * usual))
    long = last - first >= _STRAIGHT - 1
    return Frozen(first[long] + 1, last[long] + 1)


def _runs(true: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the first and last index of each run of what is true, (2, c)."""
    edges = np.diff(np.concatenate([[False], true, [False]]).astype(np.int8))
    return np.stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1])


def while_moving(repeated: Frozen, record: Record, output: Array) -> Frozen:
    """Return those repeats in which a model's output moves beyond noise and grid.

    Args:
        repeated: see `repeats`; one at least.
        record: as it was sampled.
        output: of a model that was fitted, at the same times, (n,) [m].
    """
    y, first, last = record.measured, repeated.first - 1, repeated.last
    edges = np.stack([first, last + 1], axis=1).ravel()
    edges = edges[edges < len(y)]
    motion = np.maximum.reduceat(output, edges) - np.minimum.reduceat(output, edges)
    far = motion[::2] > max(_BEYOND * _noise(y - output), _STEPS * _grid(y))
    far &= (y[last] > y.min()) & (y[last] < y.max())  # else it is at an end of its range
    return Frozen(repeated.first[far], last[far])


def while_bending(lines: Frozen, record: Record, output: Array) -> Frozen:
    """Return those lines from which a model's output departs beyond noise.

    Args:
        lines: see `lines`; one at least.
        record: as it was sampled.
        output: of a model that was fitted, at the same times, (n,) [m].
    """
    noise = _noise(record.measured - output)
    ends = list(zip(lines.first - 1, lines.last + 2, strict=True))
    own, bends = (np.array([_bend(c[a:b]) for a, b in ends]) for c in (record.measured, output))
    # Slow motion without noise is nearly straight, and so is its model.
    far = bends > np.maximum(_DEPARTING * noise, _BEYOND * own)
    return Frozen(lines.first[far], lines.last[far])


def _grid(values: Array) -> float:
    steps = np.abs(np.diff(values))
    return float(steps[steps > 0.0].min(initial=np.inf))


def _noise(error: Array) -> float:
    return 1.4826 * float(np.median(np.abs(error - np.median(error))))


def _bend(values: Array) -> float:
    """Return how far values (n,) depart from the line between their ends."""
    return float(np.ptp(values - np.linspace(values[0], values[-1], len(values))))


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
