"""The balance of forces of a sub-step: the displacement increment dx, each for one lane.

    specimen(x + dx) + friction = push - (stiff + DAMPING_2) dx

push and stiff from stages.drive. A proportional specimen and one with a gap are solved exactly,
any other by Newton steps from the last increment. Dry friction is a return mapping: the trial
force without slip first, friction takes what it can and the rest moves the piston (unconditionally
stable, no branch per lane).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.catalogue import specimen_gap, specimen_yield
from actuator_glue.model.effects.catalogue.specimen_hardening import cubic
from actuator_glue.model.effects.dead_zone import beyond
from actuator_glue.records import Array


@njit
def proportional(w: Array, n: int, push: Any, touched: Any) -> Any:
    """Increment against f = k x; `touched` is one over the stiffness with the specimen."""
    return beyond(push - w[r.STIFFNESS + n] * w[r.X + n], w[r.COULOMB + n]) * touched


@njit
def specimen(w: Array, n: int, guess: Any, gaps: bool, yields: bool) -> Any:
    """Force and tangent of the specimen after an increment `guess`.

    Where it yields, MIDDLE and SOFT hold `halfway` of the guess.
    """
    g = w[specimen_gap.GAP + n]
    there = w[r.X + n] + guess
    after = beyond(there, g) if gaps else there
    ratio = w[specimen_yield.RATIO + n]
    secant, more = cubic(w, n, after)
    force = after * (ratio + secant)
    tangent = ratio + more
    if yields:
        moved = specimen_gap.passed(w, n, guess, gaps)
        z, share = specimen_yield.yielded(w, n, moved)
        force += (1.0 - ratio) * z
        tangent += (1.0 - ratio) * share
    tangent *= w[r.STIFFNESS + n]
    if gaps:
        tangent = tangent if abs(there) >= g else 0.0
    return w[r.STIFFNESS + n] * force, tangent


@njit
def look(
    w: Array, n: int, push: Any, stiff: Any, dry: Any, guess: Any, force: Any, tangent: Any
) -> Any:
    """Newton step: the increment against force and tangent of the specimen after `guess`."""
    trial = push - force + tangent * guess
    return beyond(trial, dry) / (stiff + w[r.DAMPING_2 + n] + tangent)


# Newton steps end where one is this small against the increment of the last sub-step: the next
# would be its square.
_SMALL: Final = 3e-3
# ... or against rounding [m].
_LEAST: Final = 1e-13
# Newton steps at most, of a force that follows the velocity, which may be steep, or has a kink.
MOST: Final = 40


@njit
def begin(w: Array, ahead: bool) -> None:
    """Start Newton steps at the last increment or, `ahead`, where that goes on as it did."""
    for n in range(r.LANES):
        more = w[r.DX + n] - w[r.DX_BEFORE + n] if ahead else 0.0
        w[r.IN_DX + n] = w[r.IN_TRIED + n] = w[r.DX + n] + more
        w[r.DX_BEFORE + n] = w[r.DX + n]
        w[r.IN_LOW + n], w[r.IN_HIGH + n] = -np.inf, np.inf


@njit
def settled(w: Array) -> bool:
    """Whether the Newton steps from IN_TRIED to IN_DX were the last; where not, prepare the next.

    The force that is left falls with the increment, so that a step tells on which side of its
    start the solution lies. A step beyond where the solution can be goes half way: where friction
    turns within less than a step's motion, Newton's steps would leap to and fro. A lane that has
    settled stays where it is, whatever its neighbours need.
    """
    open_lanes = 0
    for n in range(r.LANES):
        tried, to = w[r.IN_TRIED + n], w[r.IN_DX + n]
        low = max(w[r.IN_LOW + n], tried) if to > tried else w[r.IN_LOW + n]
        high = min(w[r.IN_HIGH + n], tried) if to < tried else w[r.IN_HIGH + n]
        to = 0.5 * (low + high) if to <= low or to >= high else to
        more = abs(to - tried) > _SMALL * abs(w[r.DX + n]) + _LEAST
        open_lanes += more
        w[r.IN_DX + n] = w[r.IN_TRIED + n] = to
        w[r.IN_LOW + n] = low if more else to
        w[r.IN_HIGH + n] = high if more else to
    return open_lanes == 0
