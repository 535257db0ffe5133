"""Snooker move: ter Braak and Vrugt (2008), Eqs. (2)-(4), with points of the archive."""

from __future__ import annotations

import math
from typing import Final

from actuator_glue.inference.moves.draw import distinct
from actuator_glue.inference.moves.move import (
    NO_CLASS,
    U_FREE,
    Knobs,
    Move,
    Scratch,
    Tuning,
)
from actuator_glue.jit import njit
from actuator_glue.records import Array


@njit
def propose(
    z: Array,
    uniforms: Array,
    rows: Array,
    size: int,
    tuning: Tuning,
    knobs: Knobs,
    scratch: Scratch,
    candidate: Array,
) -> tuple[float, int]:
    """Write a candidate on the line from an archive point through z: a `Move.propose`.

    candidate = z + gamma (P(b) - P(c)), gamma ~ U(1.2, 2.2), with P the orthogonal projection on
    the line through z and the anchor a; a, b, c are three different archive points. The Hastings
    correction is (|candidate - a| / |z - a|)^(d - 1). Lengths and projections are taken in
    coordinates divided by their standard deviation, so that no coordinate rules the others.
    """
    scale, indices = tuning.scale, scratch.indices
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
        return 0.0, NO_CLASS
    gamma = 1.2 + uniforms[U_FREE + 3]
    shift = gamma * along / length2
    for j in range(d):
        candidate[j] = z[j] + shift * (z[j] - anchor[j])
    # |candidate - a| = |1 + shift| |z - a| because all three lie on one line.
    return (d - 1.0) * math.log(abs(1.0 + shift)), NO_CLASS


SNOOKER: Final = Move('snooker', propose, lambda dimension, pairs: 4, share=0.1)
