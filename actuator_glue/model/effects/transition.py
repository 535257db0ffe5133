"""Transition matrix of a linear system, and its integrals times the input."""

from __future__ import annotations

from functools import partial
from typing import Any, Final

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.records import Array

# The transition matrix is found by its Taylor series, halved until its norm is below this.
_NORM: Final = 0.25
_TERMS: Final = 13

_strict: Any = partial(njit, fastmath=False)


@_strict
def fill(
    a: Array, b: Array, scale: Array, t: float, phi: Array, first: Array, second: Array
) -> None:
    """Fill exp(A t), its integral times b, and its double integral times b, for p states.

    scale (p,) brings the states to like size.
    """
    p = len(a)
    n = p + 2
    big = np.zeros((n, n))
    for i in range(p):
        for j in range(p):
            big[i, j] = a[i, j] * t * scale[j] / scale[i]
        big[i, p] = b[i] * t / scale[i]
    big[p, p + 1] = 1.0
    size = 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += abs(big[i, j])
        size = max(size, total)
    squarings = 0
    while size > _NORM and squarings < 60:
        size *= 0.5
        squarings += 1
    big *= 0.5**squarings
    result = np.eye(n)
    term = np.eye(n)
    for order in range(1, _TERMS):
        term = _times(term, big, n, 1.0 / order)
        result += term
    for _ in range(squarings):
        result = _times(result, result, n, 1.0)
    for i in range(p):
        for j in range(p):
            phi[i, j] = result[i, j] * scale[i] / scale[j]
        first[i] = result[i, p] * scale[i]
        second[i] = result[i, p + 1] * scale[i] * t


@_strict
def _times(left: Array, right: Array, n: int, factor: float) -> Array:
    out = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            value = left[i, j] * factor
            if value != 0.0:
                for c in range(n):
                    out[i, c] += value * right[j, c]
    return out
