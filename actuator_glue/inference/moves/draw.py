"""Uniforms turned into archive indices and classes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.records import Array


@njit
def distinct(
    uniforms: Array, first: int, count: int, size: int, indices: NDArray[np.int64]
) -> None:
    """Write an ordered sample of range(size) without replacement into indices[0, :count].

    A Fisher-Yates shuffle of which only the first entries are made: position indices[1, m] holds
    indices[2, m] instead of its own number. indices has shape (3, >= count).
    """
    for k in range(count):
        position = k + int(uniforms[first + k] * (size - k))
        here = position
        mine = k
        for m in range(k):
            if indices[1, m] == position:
                here = indices[2, m]
            if indices[1, m] == k:
                mine = indices[2, m]
        indices[0, k] = here
        indices[1, k] = position
        indices[2, k] = mine


@njit
def choose(uniform: float, cumulative: Array) -> int:
    """Return the class that a uniform falls into, given cumulative probabilities."""
    k = 0
    while k < cumulative.size - 1 and uniform >= cumulative[k]:
        k += 1
    return k
