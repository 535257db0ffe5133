"""Snooker move: ter Braak and Vrugt (2008), Eqs. (2)-(4), with points of the archive."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.moves import U_FREE
from actuator_glue.inference.moves.draw import distinct
from actuator_glue.jit import njit
from actuator_glue.records import Array


@njit
def propose(
    z: Array, uniforms: Array, rows: Array, size: int, scale: Array, indices: NDArray[np.int64],
    candidate: Array,
) -> float:  # fmt: skip
    """Write a candidate on the line from an archive point through z, return log correction.

    candidate = z + gamma (P(b) - P(c)), gamma ~ U(1.2, 2.2), with P the orthogonal projection on
    the line through z and the anchor a; a, b, c are three different archive points. The Hastings
    correction is (|candidate - a| / |z - a|)^(d - 1). Lengths and projections are taken in
    coordinates divided by `scale`, so that no coordinate rules the others.
    """
    d = z.size
    distinct(uniforms, U_FREE, 3, size, indices)
    anchor = rows[indices[0, 0]]
    length2 = 0.0
    along = 0.0
    for j in range(d):
        line = (z[j] - anchor[j]) / scale[j]
        length2 += line * line
        along += line * (rows[indices[0, 1], j] - rows[indices[0, 2], j]) / scale[j]
    if length2 == 0.0:
        # The chain stands on the anchor: no line, stay.
        candidate[:] = z
        return 0.0
    gamma = 1.2 + uniforms[U_FREE + 3]
    shift = gamma * along / length2
    for j in range(d):
        candidate[j] = z[j] + shift * (z[j] - anchor[j])
    # |candidate - a| = |1 + shift| |z - a| because all three lie on one line.
    return (d - 1.0) * math.log(abs(1.0 + shift))
