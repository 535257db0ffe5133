"""Channels slower than their recorder: signals of a controller of 50 Hz in a record of 1 kHz.

Such a channel repeats each reading until the next one comes, at regular times, whether they are a
whole number of samples apart or not. What is measured runs smoothly between its readings. A
command may truly be held, as a slow controller holds it, or only its record is: what explains the
response better is taken.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from actuator_glue.hygiene.checks import where
from actuator_glue.inference.least_squares import decimate
from actuator_glue.inference.least_squares.data import SETTLE, Data
from actuator_glue.inference.least_squares.fit import base_fit
from actuator_glue.model.exact import Initial
from actuator_glue.records import Array, Record

_FEWEST = 50  # changes that tell a rate
# Samples from one reading to the next: with fewer, any change would seem to come when it is due.
_FASTEST, _SLOWEST = 1.9, 500.0
_REGULAR = 0.98  # of the changes come when they are due
_DUE = 0.6  # samples beside their time: it is somewhere within one
_BETTER = 0.98  # of the error that steps leave: what leaves more is no better


@dataclass(frozen=True)
class Readings:
    """When a channel got a new reading.

    Attributes:
        samples: first samples of readings, (m,).
        times: when they were taken, in samples, (m,).
        every: samples from one to the next.
    """

    samples: NDArray[np.intp]
    times: Array
    every: float


def readings(values: Array) -> Readings | None:
    """Return the readings of a channel (n,); None where it may have one at each sample."""
    moved = values[1:] != values[:-1]
    if 1.5 * np.count_nonzero(moved) > len(values) + 2:  # half of them follow another at once
        return None
    at = np.flatnonzero(moved) + 1
    if len(at) < _FEWEST:
        return None
    gaps = np.diff(at)
    typical = float(gaps[gaps <= 1.5 * np.median(gaps)].mean())
    if not _FASTEST <= typical <= _SLOWEST:
        return None
    count = np.concatenate([[0], np.cumsum(np.rint(gaps / typical))])
    if not count[-1] > 0.0:
        return None
    every, first = np.polyfit(count, at, 1)
    count = np.rint((at - first) / every)
    if np.mean(np.abs(at - first - every * count) <= _DUE) < _REGULAR:
        return None
    whole = round(every)
    in_step = abs(every - whole) * float(np.ptp(count)) < 0.5
    if in_step:
        every, first = float(whole), float(np.bincount(at % whole).argmax())
        count = np.rint((at - first) / every)
    last = math.floor((len(values) - 1 - first) / every)
    numbers = np.arange(math.ceil(-first / every), last + 1)
    samples = np.rint(first + every * numbers).astype(np.intp)
    # Where it changed tells better than the mean rate when the reading was there.
    known = (count >= numbers[0]) & (count <= numbers[-1])
    samples[(count[known] - numbers[0]).astype(np.intp)] = at[known]
    late = 0.0 if in_step else 0.5  # a reading is shown by the first sample after it
    return Readings(samples, first - late + every * numbers, float(every))


def smooth(values: Array, known: Readings) -> Array:
    """Return a channel (n,) with a cubic through its readings."""
    curve = scipy.interpolate.CubicSpline(known.times, values[known.samples])
    return np.asarray(curve(_within(values, known)))


def lines(values: Array, known: Readings) -> Array:
    """Return a channel (n,) with straight lines between its readings."""
    return np.asarray(np.interp(np.arange(len(values)), known.times, values[known.samples]))


def _within(values: Array, known: Readings) -> Array:
    return np.clip(np.arange(float(len(values))), known.times[0], known.times[-1])


def measured_filled(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Return records whose measured channels run smoothly between their readings; what was done.

    No delay of half a reading is left then.
    """
    out, notes = [], []
    for i, record in enumerate(records):
        known = readings(record.measured)
        if known is not None:
            notes.append(
                f'{where(record, i + 1)}: the measured displacement {_told(record, known)}; a '
                'cubic runs between its changes'
            )
            record = _between(replace(record, measured=smooth(record.measured, known)), known)
        if record.force is not None and (known := readings(record.force)) is not None:
            record = replace(record, force=smooth(record.force, known))
        out.append(record)
    return out, notes


def command_filled(
    records: Sequence[Record], initials: Sequence[Initial]
) -> tuple[list[Record], list[str]]:
    """Return records whose commands run as the responses tell, where they were recorded in steps.

    Args:
        records: checked records, what is measured in them filled.
        initials: per record, the state it starts from.

    Returns:
        The records, and what was found and done.
    """
    ways: dict[str, Callable[[Array, Readings], Array]] = {
        'straight lines': lines,
        'a cubic': smooth,
    }
    out, notes = [], []
    for i, (record, initial) in enumerate(zip(records, initials, strict=True)):
        out.append(record)
        known = readings(record.command)
        if known is None:
            continue
        others = {
            way: replace(record, command=made(record.command, known), hold='linear')
            for way, made in ways.items()
        }
        left = {way: _left(other, initial) for way, other in others.items()}
        best, steps = min(left, key=left.__getitem__), _left(record, initial)
        told = f'{where(record, i + 1)}: the command {_told(record, known)}; '
        errors = f'{1e6 * left[best]:.1f} um of error for {1e6 * steps:.1f} um'
        if left[best] < _BETTER * steps:
            out[i] = _between(others[best], known)
            told += (
                f'with {best} in place of its steps Eq. (2) leaves {errors}, and so it is taken: '
                'record the command that the controller puts out, at its own rate'
            )
        else:
            told += (
                f'its steps are taken as they are, for with {best} in place of them Eq. (2) '
                f'leaves {errors}'
            )
        notes.append(told)
    return out, notes


def _between(record: Record, known: Readings) -> Record:
    """Return a record from the first reading to the last one: beyond them nothing is known."""
    return record.slice(math.ceil(known.times[0]), math.floor(known.times[-1]) + 1)


def _told(record: Record, known: Readings) -> str:
    return (
        f'changes in one sample of {known.every:.4g} only, its channel gives '
        f'{record.rate / known.every:.4g} Hz of {record.rate:.4g}'
    )


def _left(record: Record, initial: Initial) -> float:
    """Return the root mean square that Eq. (2) leaves of a record [m]."""
    slow = decimate.decimated(record, decimate.factor(record))
    mask = np.ones(len(slow), dtype=np.bool_)
    if initial == 'measured' and record.duration > 2.0 * SETTLE:
        mask[: round(SETTLE / slow.period)] = False
    data = replace(Data.whole([slow]), masks=(mask,), initials=(initial,))
    return base_fit(data).rms
