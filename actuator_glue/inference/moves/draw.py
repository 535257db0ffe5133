"""Uniforms turned into archive indices, classes and normals."""

from __future__ import annotations

import math

from actuator_glue.jit import njit


@njit
def distinct(uniforms, first, indices, displaced, size):  # type: ignore[no-untyped-def]
    """Fill indices with an ordered sample of range(size) without replacement.

    A Fisher-Yates shuffle of which only the first entries are made: position[k] = displaced[0, k]
    holds displaced[1, k] instead of its own number. displaced is scratch of shape (2, count).
    """
    for k in range(indices.size):
        position = k + int(uniforms[first + k] * (size - k))
        here = position
        mine = k
        for m in range(k):
            if displaced[0, m] == position:
                here = displaced[1, m]
            if displaced[0, m] == k:
                mine = displaced[1, m]
        indices[k] = here
        displaced[0, k] = position
        displaced[1, k] = mine


@njit
def choose(uniform, cumulative):  # type: ignore[no-untyped-def]
    """Return the class that a uniform falls into, given cumulative probabilities."""
    k = 0
    while k < cumulative.size - 1 and uniform >= cumulative[k]:
        k += 1
    return k


@njit
def normal_pair(u1, u2):  # type: ignore[no-untyped-def]
    """Return two independent standard normal numbers (Box and Muller)."""
    radius = math.sqrt(-2.0 * math.log1p(-u1))
    return radius * math.cos(2.0 * math.pi * u2), radius * math.sin(2.0 * math.pi * u2)
