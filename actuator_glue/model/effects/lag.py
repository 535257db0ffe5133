"""Every lane's own command: delayed, and read on a clock that runs slow or fast.

Three passes over the lanes. Where a lane reads the command is vector code, and so is what it makes
of the samples there. Only fetching them goes lane by lane: the compiler cannot know that the
command and the table do not overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects import command
from actuator_glue.model.effects import layout as r
from actuator_glue.records import Array

# Samples fetched per lane: those at both ends of a sub-step, and where the command runs linearly
# the ones after them.
PLACES = 4 * r.LANES


@njit
def prepare(w: Array, substeps: int) -> None:
    """Write what stays over the samples of one call."""
    for n in range(r.LANES):
        w[r.PER_CLOCK + n] = substeps / (1.0 - w[r.SKEW + n])


@njit
def _inside(at: Any, last: Any) -> Any:
    """Sample `at` of 0 .. last, held beyond; 0 for what is not a number."""
    at = at if at > 0.0 else 0.0
    return np.int32(at if at < last else last)


@njit
def _find(
    w: Array,
    places: NDArray[np.int32],
    last: float,
    offset: int,
    at: float,
    step: float,
    linear: bool,
) -> None:
    """Write which samples every lane needs, and what part of each.

    Args:
        w: table.
        places: (PLACES,) output.
        last: index of the last command sample.
        offset: stream index of command sample 0.
        at: beginning of the sub-step [samples].
        step: its length [samples].
        linear: whether the command runs linearly between samples.
    """
    for n in range(r.LANES):
        clock = 1.0 - w[r.SKEW + n]
        start = at * clock - w[r.LAG_SAMPLES + n]
        stop = start + clock * step
        i, k = np.floor(start), np.floor(stop)
        w[r.IN_SHARE + n] = (stop - k) * w[r.PER_CLOCK + n] if k > i else 0.0
        places[n] = _inside(i - offset, last)
        places[r.LANES + n] = _inside(k - offset, last)
        if linear:
            w[r.IN_PART + n], w[r.IN_PART_STOP + n] = start - i, stop - k
            places[2 * r.LANES + n] = _inside(i - offset + 1.0, last)
            places[3 * r.LANES + n] = _inside(k - offset + 1.0, last)


@njit
def _fetch(w: Array, places: NDArray[np.int32], u: Array, count: int) -> None:
    for m in range(count):
        # An index without sign: numba would add a test for one that counts from the end.
        w[r.IN_U + m] = u[np.uint32(places[m])]


@njit
def held(
    w: Array, places: NDArray[np.int32], u: Array, offset: int, at: float, step: float
) -> None:
    """Write every lane's mean, slope and jump of a held command over a sub-step.

    Any fractional shift of it keeps its integral and its centre.

    Args:
        w: table.
        places: (PLACES,) scratch.
        u: command samples [m].
        offset: stream index of u[0].
        at: beginning of the sub-step [samples].
        step: its length, at most 1 [samples].
    """
    _find(w, places, u.shape[0] - 1.0, offset, at, step, False)
    _fetch(w, places, u, 2 * r.LANES)
    for n in range(r.LANES):
        share, left = w[r.IN_SHARE + n], w[r.IN_U + n]
        jump = w[r.IN_U_STOP + n] - left
        w[r.IN_JUMP + n], w[r.IN_MEAN + n] = jump, left + jump * share
        w[r.IN_SLOPE + n] = 6.0 * jump * share * (1.0 - share)


@njit
def linear(
    w: Array, places: NDArray[np.int32], u: Array, offset: int, at: float, step: float
) -> None:
    """Write every lane's mean and slope of a linear command over a sub-step; as `held`."""
    _find(w, places, u.shape[0] - 1.0, offset, at, step, True)
    _fetch(w, places, u, 4 * r.LANES)
    for n in range(r.LANES):
        share, left, right = w[r.IN_SHARE + n], w[r.IN_U + n], w[r.IN_U_STOP + n]
        first = left + w[r.IN_PART + n] * (w[r.IN_U_NEXT + n] - left)
        end = right + w[r.IN_PART_STOP + n] * (w[r.IN_U_STOP_NEXT + n] - right)
        mean, slope = command.kinked(first, right, end, share)
        w[r.IN_MEAN + n], w[r.IN_SLOPE + n] = mean, slope
