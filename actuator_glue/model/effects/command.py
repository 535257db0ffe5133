"""Mean and slope of a command between two times: those of a line with the same first moment."""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.records import Array


@njit
def held(u: Array, at: int) -> Any:
    """Command sample `at`, held constant before the first and after the last one."""
    return u[min(max(at, 0), u.shape[0] - 1)]


@njit
def kinked(first: Any, kink: Any, last: Any, share: Any) -> Any:
    """Mean and slope of a command from `first` by `kink` to `last`, in the last `share` of it.

    The slope is that of the ramp with the same first moment: with both, any fractional shift of
    a command keeps its integral and its centre. A share of zero is no kink.
    """
    middle = kink if share > 0.0 else last
    before, after = (first + middle) * (1.0 - share), (middle + last) * share
    # 12 times the moment of the triangle by which a kink leaves the straight line.
    bend = middle - first * share - last * (1.0 - share)
    return 0.5 * (before + after), last - first + bend * (1.0 - 2.0 * share)


@njit
def linear(u: Array, offset: int, start: float, stop: float) -> Any:
    """Mean and slope of a linear command over [start, stop] samples (at most one sample long)."""
    i, k = math.floor(start), math.floor(stop)
    left, right = held(u, i - offset), held(u, k - offset)
    first = left + (start - i) * (held(u, i + 1 - offset) - left)
    last = right + (stop - k) * (held(u, k + 1 - offset) - right)
    return kinked(first, right, last, (stop - k) / (stop - start) if k > i else 0.0)
