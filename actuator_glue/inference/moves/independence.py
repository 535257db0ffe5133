"""Independence move: candidates from a Student t fitted to the archive.

An addition to Vrugt (2016): where the posterior is near a single hill the fitted density proposes
almost independent draws; elsewhere its share falls by itself (see adaptation.py).
"""

from __future__ import annotations

import math
from typing import Final

from actuator_glue.inference import student
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
    centre, factor = tuning.centre, tuning.factor
    there = student.DEGREES + student.draw(uniforms, U_FREE, centre, factor, candidate)
    here = student.DEGREES + student.distance2(z, centre, factor, scratch.residual)
    return 0.5 * (student.DEGREES + z.size) * math.log(there / here), NO_CLASS


INDEPENDENCE: Final = Move(
    'independence', propose, lambda dimension, pairs: dimension + 4, most=0.9
)
