"""Impulses of the recorded command that the actuator was never given.

A disturbance of the recorder, often in both channels at once, is in the recorded command and not
in the motion. Simulated with it, a model is pushed where the piston never was, for good where the
valve or the specimen remember. The motion tells: the response to an impulse that was commanded is
in it in whole, that to one that was only recorded not at all.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.hygiene import impulse_removal
from actuator_glue.hygiene.checks import where
from actuator_glue.hygiene.impulses import TAPS, noise_of
from actuator_glue.inference.least_squares import decimate
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.noise import split, whiten, whitener
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

_REACH = len(TAPS) // 2
_SHORTEST = 240  # samples of a command
_BEYOND = 6.0  # times what other samples are off
_LEAST = 1e-3  # of the stroke: smaller impulses move nothing
# Samples close to each other, and how many they are among: more than that is a command's own.
_FEW, _WIDEST = 3, 20
_MOST = 0.05  # of all samples: what is more frequent is no accident
_SURE = 3.0  # standard errors
_HALF = 0.5  # of its response in the motion: commanded or not
_ALIKE = 1.0 - 1e-8  # squared correlation: response and impulses cannot be told apart


class Traces(NamedTuple):
    """Shares of a command's impulses in the measured displacement, with standard errors.

    Attributes:
        moved: of the response to them; 1 where they were commanded.
        moved_error: its standard error.
        read: of the impulses themselves, in the same samples; 1 where both channels have them.
        read_error: its standard error.
    """

    moved: float
    moved_error: float
    read: float
    read_error: float


def impulses(command: Array, period: float) -> tuple[NDArray[np.intp], Array]:
    """Return the samples of a command that stand out of those around them, and by how much.

    Args:
        command: (n,) [m].
        period: time between samples [s].

    Returns:
        Samples (m,) and sizes (m,) [m]; none where they are too many to be accidents.
    """
    nothing = np.empty(0, dtype=np.intp), np.empty(0)
    if len(command) < _SHORTEST:
        return nothing
    error = np.asarray(np.convolve(command, TAPS, 'same'), dtype=np.float64)
    error[:_REACH] = error[-_REACH:] = 0.0
    stroke = float(np.abs(command - np.median(command)).max())
    limit = np.maximum(_BEYOND * noise_of(error, period), _LEAST * stroke)
    suspect = np.flatnonzero(np.abs(error) > limit)
    if not len(suspect) or len(suspect) > (_REACH + 1) * _MOST * len(command):
        return nothing
    samples: list[int] = []
    sizes: list[float] = []
    for group in np.split(suspect, np.flatnonzero(np.diff(suspect) > 2 * _REACH) + 1):
        begin = max(0, int(group[0]) - _REACH)
        part = slice(begin, int(group[-1]) + _REACH + 1)
        # An impulse next to another one may not stand out.
        places = range(int(group[0]) - begin, int(group[-1]) + 1 - begin)
        found = _explained(error[part], limit[part], places)
        if found is not None:
            samples += [begin + i for i in found[0]]
            sizes += list(found[1])
    if len(samples) > _MOST * len(command):
        return nothing
    return np.array(samples, dtype=np.intp), np.array(sizes)


def _explained(error: Array, limit: Array, places: range) -> tuple[tuple[int, ...], Array] | None:
    """Return the fewest samples (and by how much each is off) that leave nothing that stands out.

    None where a few do not, or where a corner or a step of the command leaves less.

    Args:
        error: of the polynomials around what stands out (w,) [m].
        limit: beyond which it does (w,) [m].
        places: samples that may be off.
    """

    def left(basis: Basis) -> float:
        off = error - basis.shapes @ (basis.inverse @ error)
        return float(np.max(np.abs(off) / limit))

    if len(places) > _WIDEST:
        return None
    by_command = min(left(basis) for basis in _commanded(len(error), places))
    for count in range(1, min(_FEW, len(places)) + 1):
        pulses = _pulses(len(error), places, count)
        by_pulses = [left(basis) for basis in pulses]
        best = int(np.argmin(by_pulses))
        if min(by_pulses[best], by_command) < 1.0:
            found = pulses[best]
            sizes = found.inverse @ error
            return (found.samples, sizes) if by_pulses[best] < by_command else None
    return None


class Basis(NamedTuple):
    """What some samples, or a corner or step, leave of a polynomial through their neighbours.

    Attributes:
        samples: which they are.
        shapes: errors of the polynomials (w, m).
        inverse: least squares (m, w).
    """

    samples: tuple[int, ...]
    shapes: Array
    inverse: Array


def _basis(width: int, samples: tuple[int, ...], shape: Callable[[Any], Any]) -> Basis:
    at = np.arange(-_REACH, width + _REACH)[:, None] - np.array(samples)
    rows = np.asarray(shape(at), dtype=np.float64).T
    shapes = np.stack([np.convolve(row, TAPS, 'valid') for row in rows], axis=1)
    return Basis(samples, shapes, np.linalg.pinv(shapes))


@lru_cache(maxsize=32)
def _pulses(width: int, places: range, count: int) -> tuple[Basis, ...]:
    some = itertools.combinations(places, count)
    return tuple(_basis(width, chosen, lambda at: at == 0) for chosen in some)


@lru_cache(maxsize=32)
def _commanded(width: int, places: range) -> tuple[Basis, ...]:
    steps = (_basis(width, (i,), lambda at: at >= 0) for i in places)
    corners = (_basis(width, (i,), np.abs) for i in places)
    between = (_basis(width, pair, np.abs) for pair in itertools.pairwise(places))
    return (*steps, *corners, *between)


def shares(record: Record, mended: Record, theta: Array, initial: Initial) -> Traces | None:
    """Return how much of a command's impulses moved the piston, and was read beside it.

    Generalised least squares of the residual without them; None where the model diverges or they
    leave no trace.

    Args:
        record: as recorded.
        mended: without the impulses of the command.
        theta: parameters of Eq. (2) (4,).
        initial: state that the record starts from.
    """
    model, off = Structure(()), record.command - mended.command
    outputs = [model.simulate(theta, r, initial=initial) for r in (record, mended)]
    residual = record.measured - outputs[1]
    if not all(np.isfinite(y).all() for y in outputs):
        return None
    taps = whitener(split(residual, record.period).all_of_it())
    rows = whiten(np.stack([outputs[0] - outputs[1], off]), taps)
    white = whiten(residual, taps)
    normal = rows @ rows.T
    seen = np.diag(normal)
    if not ((seen > 0.0).all() and normal[0, 1] ** 2 < _ALIKE * seen[0] * seen[1]):
        return None
    found = np.linalg.solve(normal, rows @ white)
    left = white - found @ rows
    error = np.sqrt(max(1.0, float(np.mean(left**2))) * np.diag(np.linalg.inv(normal)))
    return Traces(float(found[0]), float(error[0]), float(found[1]), float(error[1]))


def never_given(found: Traces) -> bool:
    """Whether the piston did not respond: surely, or probably where the reading has them too.

    A share far below zero comes from what the model lacks and says nothing: it must be less than
    half as far from zero as from one.
    """
    sure = found.moved + _SURE * found.moved_error < _HALF
    return -2.0 * _HALF < found.moved < _HALF and (sure or _in_both(found))


def _in_both(found: Traces) -> bool:
    return found.read - _SURE * found.read_error > _HALF


def without(record: Record, samples: NDArray[np.intp], sizes: Array) -> Record:
    """Return a record whose command is less by some sizes (m,) [m] at some samples (m,)."""
    if not len(samples):
        return record
    command = record.command.copy()
    command[samples] -= sizes
    return replace(record, command=command)


def mended(
    records: Sequence[Record], initials: Sequence[Initial]
) -> tuple[list[Record], list[str]]:
    """Remove impulses that no actuator was given from commands, and their share from readings.

    Args:
        records: checked records of one actuator.
        initials: per record, the state it starts from.

    Returns:
        The records, the same objects where nothing was done, and what was done, for people.
    """
    found = [impulses(r.command, r.period) for r in records]
    if not any(len(samples) for samples, _ in found):
        return list(records), []
    clean = [without(r, *each) for r, each in zip(records, found, strict=True)]
    slow = [decimate.decimated(r, decimate.factor(r)) for r in clean]
    whole = replace(Data.whole(slow), initials=tuple(initials))
    theta, out, notes = impulse_removal.trimmed(whole), list(records), []
    for i, (record, smooth) in enumerate(zip(records, clean, strict=True)):
        samples, sizes = found[i]
        told = shares(record, smooth, theta, initials[i]) if len(samples) else None
        if told is None or not never_given(told):
            continue
        note = (
            f'{where(record, i + 1)}: impulses in the command, {len(samples)} samples (up to '
            f'{1e6 * float(np.abs(sizes).max()):.0f} um) did not move the piston (share of the '
            f'response {told.moved:.2f} +- {told.moved_error:.2f}): what the samples around them '
            'say stands in their place'
        )
        out[i] = smooth
        if _in_both(told):
            measured = record.measured.copy()
            measured[samples] -= told.read * sizes
            out[i] = replace(smooth, measured=measured)
            note += (
                f'; {told.read:.2f} +- {told.read_error:.2f} of them is in the measured '
                'displacement of the same samples, and taken out there, too'
            )
        notes.append(note)
    return out, notes
