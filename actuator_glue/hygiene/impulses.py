"""Impulses in a measured channel: single samples or short runs that no motion explains.

Every sample of a model's residual is predicted from its neighbours on both sides. An impulse (an
additive outlier, Fox 1972; Chen & Liu 1993) exceeds by far the noise of that prediction and the
residual around it, and leaves only noise behind when the prediction takes its place. A kink that
the model lacks does not: it stands out of the residual by little.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from actuator_glue import robust
from actuator_glue.records import Array

_REACH = 6  # samples to either side
_ROWS = 40_000  # of a record that the interpolator is fitted to
_BLOCK = 1.0  # s in which the noise has one size
_BEYOND = 6.0  # times the noise: one Gaussian sample in 10^9
_LONGEST = 40  # samples of one impulse
_SURE = 3.5  # standard deviations
_AGREED = 0.5  # mean resultant of phases that agree
# Error of the polynomial of fifth order through three samples on either side: at a twelfth of the
# rate it is 1e-3 of a sine.
TAPS = np.array([-1.0, 6.0, -15.0, 20.0, -15.0, 6.0, -1.0]) / 20.0
_ABRUPT = 0.25  # of a run's size
_HALF, _STDERRS = 0.5, 3.0  # of impulses that are surely in both channels
_MOST = 0.05  # of all samples: what is more frequent is no accident, and stays


@dataclass(frozen=True)
class Impulses:
    """What was found in one record.

    Attributes:
        samples: which samples, (m,).
        sizes: by how much each was off, (m,) [m].
        count: impulses; one may last several samples.
        shared: share of their sizes that the command has in the same samples, too.
    """

    samples: NDArray[np.intp]
    sizes: Array
    count: int
    shared: float = 0.0


NONE = Impulses(np.empty(0, dtype=np.intp), np.empty(0), 0)


def _filter(error: Array) -> Array:
    """Return the taps (2 reach + 1,) of the error of predicting a residual from its neighbours."""
    inner = np.arange(_REACH, len(error) - _REACH)
    at = inner[:: max(1, len(inner) // _ROWS)]
    rows = error[at[:, None] + np.delete(np.arange(-_REACH, _REACH + 1), _REACH)]
    keep = np.ones(len(at), dtype=np.bool_)
    weights = np.zeros(2 * _REACH)
    for _ in range(3):  # impulses must not bend the prediction
        weights = scipy.linalg.lstsq(rows[keep], error[at[keep]], cond=1e-12)[0]
        off = np.abs(error[at] - rows @ weights)
        largest = np.maximum(off, np.abs(rows).max(axis=1))
        keep = largest <= _BEYOND * robust.deviation(error)
        if keep.sum() < 10 * _REACH:
            break
    return np.insert(-weights, _REACH, 1.0)


def noise_of(error: Array, period: float) -> Array:
    """Return the robust size of a prediction's error at every sample, (n,) [m]."""
    size = min(len(error), max(64, round(_BLOCK / period)))
    count = len(error) // size
    edges = np.linspace(0, len(error), count + 1).astype(int)
    levels = np.array([np.median(np.abs(e)) for e in np.split(np.abs(error), edges[1:-1])])
    # Motion that begins is no impulse; a channel at rest on its grid has no noise to be beyond.
    levels = np.maximum(scipy.ndimage.maximum_filter1d(levels, 3), np.median(np.abs(error)))
    return np.repeat(robust.NORMAL * levels, np.diff(edges))


def beyond(residual: Array, period: float) -> NDArray[np.bool_]:
    """Which samples of a residual (n,) [m] stand out of those around them."""
    off = np.abs(residual - np.median(residual))
    return np.asarray(off > _BEYOND * noise_of(residual, period))


def _clusters(at: NDArray[np.intp]) -> Iterator[tuple[int, int]]:
    """Yield first and last of neighbours, none of which the next cluster's errors reach."""
    for group in np.split(at, np.flatnonzero(np.diff(at) > 2 * _REACH) + 1):
        yield int(group[0]), int(group[-1])


def _explained(error: Array, noise: Array, taps: Array) -> tuple[list[int], Array] | None:
    """Return samples (and by how much each is off) without which noise is left; None if many.

    Args:
        error: of the prediction around what is suspect (w,) [m].
        noise: its size without impulses (w,) [m].
        taps: of the prediction's error (2 reach + 1,).
    """
    chosen: list[int] = []
    places = np.arange(len(error))
    sizes, left = np.empty(0), error
    while (np.abs(left) > _BEYOND * noise).any():
        if len(chosen) == _LONGEST:
            return None
        pull = np.abs(np.convolve(left, taps, mode='same'))
        pull[chosen] = -1.0
        pull[:_REACH] = pull[-_REACH:] = -1.0
        chosen.append(int(np.argmax(pull)))
        offsets = places[:, None] - np.array(chosen) + _REACH
        inside = (offsets >= 0) & (offsets < len(taps))
        basis = np.where(inside, taps[np.clip(offsets, 0, len(taps) - 1)], 0.0)
        sizes = np.linalg.lstsq(basis, error, rcond=None)[0]
        left = error - basis @ sizes
    order = np.argsort(chosen)
    return [chosen[i] for i in order], sizes[order]


class Motion(NamedTuple):
    """The motion at the samples of a residual, on which no accident can depend.

    Attributes:
        sizes: what grows with the motion, such as the speed of the piston, (n,) each.
        phase: of the motion's cycle (n,) [rad]; NaN where a reading could be off at some phases
            only.
    """

    sizes: Sequence[Array]
    phase: Array | None = None


def find(
    residual: Array, motion: Callable[[], Motion], period: float, step: float = 0.0
) -> Impulses:
    """Return the impulses of a residual.

    There are none where they are too many to be accidents, or come with the motion.

    Args:
        residual: of a model that was fitted, (n,) [m].
        motion: returns the motion at the same samples; called only where something stands out.
        period: time between samples [s].
        step: of the channel's grid, by whose rounding a reading is off at least [m].
    """
    if len(residual) < 40 * _REACH:
        return NONE
    taps = _filter(residual)[::-1]  # `convolve` reverses them
    error = np.asarray(np.convolve(residual, taps, 'same'), dtype=np.float64)
    error[:_REACH] = error[-_REACH:] = 0.0
    rounding = step / math.sqrt(12.0)
    noise, whole = (np.maximum(noise_of(e, period), rounding) for e in (error, residual))
    suspect = np.flatnonzero(np.abs(error) > _BEYOND * noise)
    if not len(suspect) or len(suspect) > 2 * _REACH * _MOST * len(residual):
        return NONE
    edges = np.abs(np.convolve(residual, TAPS, 'same'))
    samples, sizes, starts = [], [], []
    for first, last in _clusters(suspect):
        part = slice(max(0, first - 2 * _REACH), min(len(error), last + 2 * _REACH + 1))
        found = _explained(error[part], noise[part], taps)
        if found is None or np.abs(found[1]).max() < _BEYOND * whole[part].max():
            continue
        runs = np.flatnonzero(np.diff(found[0], prepend=-2) > 1)
        if _is_a_motion(np.split(found[1], runs[1:]), edges[part]):
            continue
        samples += [part.start + i for i in found[0]]
        sizes += list(found[1])
        starts += [part.start + found[0][i] for i in runs]
    if not samples or len(samples) > _MOST * len(residual):
        return NONE
    sizes_of, phase = motion()
    if _with_motion(starts, sizes_of) or (phase is not None and _at_a_phase(phase[starts], phase)):
        return NONE
    return Impulses(np.array(samples, dtype=np.intp), np.array(sizes), len(starts))


def _is_a_motion(runs: Sequence[Array], edges: Array) -> bool:
    """Whether a long run of samples comes and goes as a motion does that a model lacks.

    What is wrong for some samples (a drop-out) begins or ends between two of them; a valve that
    saturates once takes the piston aside and back.

    Args:
        runs: by how much the samples of each run are off [m].
        edges: error of the polynomials around them (w,) [m]; of a step half of it.
    """
    longest = max(runs, key=len)
    return len(longest) > _REACH and float(edges.max()) < _ABRUPT * float(np.abs(longest).max())


def in_command(command: Array, found: Impulses) -> float:
    """Return the share of a reading's impulses that the command of the same samples has.

    A motion does not answer within the sample: an impulse in both channels is the recorder's.
    Beside a rough command only many impulses together show it. 0 where the share is not surely
    more than half.

    Args:
        command: as recorded (n,) [m].
        found: the impulses of its measured displacement.
    """
    if not len(found.samples):
        return 0.0
    error = np.asarray(np.convolve(command, TAPS, 'same'), dtype=np.float64)
    noise = robust.deviation(error)
    # Impulses next to each other also enter each other's polynomials.
    off = np.zeros(len(command))
    off[found.samples] = found.sizes
    seen = np.convolve(off, TAPS, 'same')[found.samples]
    power = float(seen @ seen)
    share = float(seen @ error[found.samples]) / power
    return share if share - _STDERRS * noise / math.sqrt(power) > _HALF else 0.0


def _with_motion(starts: list[int], motion: Sequence[Array]) -> bool:
    """Whether impulses depend on the speed or place of the piston, as no accident does."""
    ranks = [scipy.stats.rankdata(size)[starts].mean() / len(size) for size in motion]
    return bool((max(ranks) - 0.5) * np.sqrt(12.0 * len(starts)) > _SURE)


def _at_a_phase(own: Array, every: Array) -> bool:
    """Whether impulses come at one phase of the motion's cycle, or at two opposite ones.

    A piston sticks and slips once in each direction, neither where it is fastest nor where it is
    farthest out. By the mean resultant of phases that are even over the record (Rayleigh 1919),
    where most of them agree.
    """
    known = own[np.isfinite(own)]
    if len(known) < 0.5 * len(own):
        return False
    places = np.sort(every[np.isfinite(every)])
    even = 2.0 * np.pi * np.searchsorted(places, known) / len(places)
    largest = max(abs(np.exp(1j * k * even).mean()) for k in (1, 2))
    return bool(largest > _AGREED and len(known) * largest**2 > _SURE**2)
