"""Readings that nobody measured: they stand still, or run straight, where the piston must not.

A converter that hangs, or a packet that is sent again, repeats one value exactly, for longer than
readings of that channel usually stand; where it ends, the reading catches up at once with what the
piston did meanwhile. A piston that play or friction holds still does not: it starts from where it
stood. A channel's grid holds a reading for one step at most, and one that is never exceeded is an
end of the channel's range: that is the transducer's, and stays. Missing samples that somebody
filled in lie on a straight line, with none of the noise around them and a kink at both ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue import robust
from actuator_glue.records import Array, Record

_REPEATS = 3  # equal readings at least
_LONGER = 3.0  # times as long as readings of the channel usually stand
_USUALLY = 0.95  # of them stand no longer
_BEYOND = 8.0  # times the residual's robust size
_DEPARTING = 3.0  # the same from a line, which no noise is
_STEPS = 4.0  # of the channel's grid: a piston that starts again moves by one
_COARSE = 2.0  # steps of it that a channel usually bends by
_FINE = 1e-6  # of a channel's range: what is finer nobody measures
_APART = 0.5  # of what a model says: so much beside it catches up with it, or is its kink
_DEAD = 0.25  # of all motion: no piston that is held misses so much until a record ends
_TAIL = 0.01  # of a record: a shorter end is held where the channel was interpolated
_STRAIGHT = 4  # samples on a line at least, between its ends
_BENT = 0.02  # of the usual second difference: noise is as straight once in 10^8 samples
_ROUNDED = 3e-7  # of a channel's size: single precision bends a line by so much
_NOISY = 4.0  # times the usual second difference: a kink is known to so much


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
    grid = _grid(values)
    straight = min(_BENT * usual, 1.5 * grid + _ROUNDED * float(np.abs(values).max()))
    moves = (values[2:] != values[:-2]) & (usual > _COARSE * grid)
    first, last = _runs(moves & (bend <= straight))
    long = last - first >= _STRAIGHT - 1
    return Frozen(first[long] + 1, last[long] + 1)


def _runs(true: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the first and last index of each run of what is true, (2, c)."""
    edges = np.diff(np.concatenate([[False], true, [False]]).astype(np.int8))
    return np.stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1])


def while_moving(repeated: Frozen, record: Record, output: Array) -> Frozen:
    """Return those repeats that a model's output leaves, and with which readings catch up after.

    Args:
        repeated: see `repeats`; one at least.
        record: as it was sampled.
        output: of a model that was fitted, at the same times, (n,) [m].
    """
    y, first, last = record.measured, repeated.first - 1, repeated.last
    edges = np.stack([first, last + 1], axis=1).ravel()
    edges = edges[edges < len(y)]
    motion = (np.maximum.reduceat(output, edges) - np.minimum.reduceat(output, edges))[::2]
    far = motion > max(_BEYOND * _noise(y - output), _STEPS * _grid(y), _FINE * np.ptp(y))
    far &= (y[last] > y.min()) & (y[last] < y.max())  # else it is at an end of its range
    far &= last + 1 - first > _LONGER * _usual(y)
    after = np.minimum(last + 1, len(y) - 1)
    caught = (y - output)[after] - (y - output)[last]
    thaws = np.abs(caught - (output[last] - output[first])) < _APART * motion
    dead = (motion > _DEAD * np.ptp(output)) & (last - first > _TAIL * len(y))
    far &= np.where(after > last, thaws, dead)
    return Frozen(repeated.first[far], last[far])


def while_bending(lines: Frozen, record: Record, output: Array) -> Frozen:
    """Return those lines from which a model's output departs beyond noise, between two kinks.

    Args:
        lines: see `lines`; one at least.
        record: as it was sampled.
        output: of a model that was fitted, at the same times, (n,) [m].
    """
    y = record.measured
    noise = max(_noise(y - output), _FINE * float(np.ptp(y)))
    ends = lines.first - 1, lines.last + 1
    pairs = list(zip(*ends, strict=True))
    own, bends = (np.array([_bend(c[a : b + 1]) for a, b in pairs]) for c in (y, output))
    # Slow motion without noise is nearly straight, and so is its model.
    far = bends > np.maximum(_DEPARTING * noise, _BEYOND * own)
    kinks, drawn = _kinks(y, *ends), _kinks(output, *ends)
    noise = _NOISY * float(np.median(np.abs(np.diff(y, 2))))
    far &= (np.abs(kinks - drawn) < _APART * np.abs(drawn) + noise).all(axis=0)
    return Frozen(lines.first[far], lines.last[far])


def _kinks(values: Array, begin: NDArray[np.intp], end: NDArray[np.intp]) -> Array:
    """Return how far values (n,) turn where lines between some of them begin and end, (2, c)."""
    slope = (values[end] - values[begin]) / (end - begin)
    before = values[begin] - values[np.maximum(begin - 1, 0)]
    after = values[np.minimum(end + 1, len(values) - 1)] - values[end]
    return np.stack([slope - before, after - slope])


def _usual(values: Array) -> float:
    """Return how many samples a reading of a channel (n,) usually stands."""
    moved = np.flatnonzero(np.diff(values))
    return float(np.quantile(np.diff(moved), _USUALLY)) if len(moved) > 1 else np.inf


def _grid(values: Array) -> float:
    steps = np.abs(np.diff(values))
    return float(steps[steps > 0.0].min(initial=np.inf))


def _noise(error: Array) -> float:
    return robust.deviation(error, float(np.median(error)))


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
