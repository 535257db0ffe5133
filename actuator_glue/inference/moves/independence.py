"""Independence move: candidates from a Student t fitted to the archive, bent as the archive is.

An addition to Vrugt (2016): where the posterior is near a single hill, bent or not, the fitted
density proposes almost independent draws; elsewhere its share falls by itself (see adaptation.py).
"""

from __future__ import annotations

import math
from typing import Final

from actuator_glue.inference import bend, student
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
    """Write a candidate that does not depend on z: a `Move.propose`."""
    centre, factor, along, across = tuning.centre, tuning.factor, tuning.along, tuning.across
    candidate[:] = z
    bend.shift(candidate, centre, along, across, -1.0)
    here = student.DEGREES + student.distance2(candidate, centre, factor, scratch.residual)
    there = student.DEGREES + student.draw(uniforms, U_FREE, centre, factor, candidate)
    bend.shift(candidate, centre, along, across, 1.0)
    return 0.5 * (student.DEGREES + z.size) * math.log(there / here), NO_CLASS


INDEPENDENCE: Final = Move(
    'independence', propose, lambda dimension, pairs: dimension + 4, most=0.9
)
