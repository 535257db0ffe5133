"""The balance of forces of a sub-step: the displacement increment dx, each for one lane.

    specimen(x + dx) + friction = push - (stiff + DAMPING_2) dx

push and stiff from stages.drive. A proportional specimen and one with a gap are solved exactly,
any other by Newton steps from the last increment. Dry friction is a return mapping: the trial
force without slip first, friction takes what it can and the rest moves the piston (unconditionally
stable, no branch per lane).
"""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import rows as r
from actuator_glue.records import Array

# Taylor series of exp(-t/64).
_BELL_1, _BELL_2, _BELL_3, _BELL_4 = (64.0**-i / math.factorial(i) for i in range(1, 5))


@njit
def beyond(value: Any, limit: Any) -> Any:
    """What of a value lies beyond +-limit (dead zone); a value that is not a number stays so."""
    return value - min(max(value, -limit), limit)


@njit
def proportional(w: Array, n: int, push: Any, touched: Any) -> Any:
    """Increment against f = k x; `touched` is one over the stiffness with the specimen."""
    return beyond(push - w[r.STIFFNESS + n] * w[r.X + n], w[r.COULOMB + n]) * touched


@njit
def gapped(w: Array, n: int, push: Any, stiff: Any, free: Any, touched: Any) -> Any:
    """Increment against f = k D(x, g): the position at the end is a function with two kinks.

    `free` and `touched` are one over the stiffness without and with the specimen.
    """
    x, gap, dry = w[r.X + n], w[r.GAP + n], w[r.COULOMB + n]
    against = stiff + w[r.DAMPING_2 + n]
    trial = push - w[r.STIFFNESS + n] * beyond(x, gap)
    total = push - min(max(trial, -dry), dry) + against * x
    held = beyond(total, against * gap)
    dx = (total - held) * free + held * touched - x
    return 0.0 if abs(trial) <= dry else dx


@njit
def bell(square: Any) -> Any:
    """exp(-square/2) as a polynomial to the 32nd power: no division, error below 2e-7."""
    t = min(square, 80.0)
    e = 1.0 + t * (t * (_BELL_2 + t * (_BELL_4 * t - _BELL_3)) - _BELL_1)
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    return e * e


@njit
def first_falling(w: Array, n: int, push: Any, touched: Any) -> None:
    """Size of the increment against f = k x and falling friction: a Newton step from the last.

    The size is REACH if friction does not rise again, less FALL where it rises fully.
    """
    trial = push - w[r.STIFFNESS + n] * w[r.X + n]
    level = w[r.LEVEL + n] * w[r.STRIBECK_LAG + n]
    reach = (abs(trial) - w[r.COULOMB + n] - level) * touched
    fall = w[r.STRIBECK_EXTRA + n] * touched
    w[r.LEVEL + n], w[r.IN_REACH + n], w[r.IN_FALL + n] = level, reach, fall
    guess = abs(w[r.DX + n])
    bend = w[r.STRIBECK_BEND + n] * guess
    w[r.IN_DX + n] = _falling(reach, fall * w[r.BELL + n], guess, bend)


@njit
def next_falling(w: Array, n: int) -> None:
    """Another Newton step."""
    guess = w[r.IN_DX + n]
    bend = w[r.STRIBECK_BEND + n] * guess
    taken = w[r.IN_FALL + n] * bell(bend * guess)
    w[r.IN_DX + n] = _falling(w[r.IN_REACH + n], taken, guess, bend)


@njit
def _falling(reach: Any, taken: Any, guess: Any, bend: Any) -> Any:
    """Newton step on size = reach - taken(size): its slope is at most 1/2, which saves a division.

    See coefficients.MEMORY_MARGIN.
    """
    slope = bend * taken
    missing = reach - taken - guess
    return max(guess + missing * (1.0 + slope + slope * slope), 0.0)


@njit
def last_falling(w: Array, n: int, push: Any) -> Any:
    """The increment with its sign; friction rises to its level at the end of the step."""
    size = w[r.IN_DX + n]
    rise = bell(w[r.STRIBECK_BEND + n] * size * size)
    w[r.LEVEL + n] += w[r.STRIBECK_EXTRA + n] * rise
    w[r.BELL + n] = rise
    return size if push - w[r.STIFFNESS + n] * w[r.X + n] > 0.0 else -size


@njit
def friction_rise(w: Array, n: int, dx: Any) -> Any:
    """Rise of dry friction over its sliding value at the end of a step by dx."""
    rise = bell(w[r.STRIBECK_BEND + n] * dx * dx)
    return w[r.LEVEL + n] * w[r.STRIBECK_LAG + n] + w[r.STRIBECK_EXTRA + n] * rise


@njit
def passed(w: Array, n: int, dx: Any, gaps: bool) -> Any:
    """What of an increment moves the specimen."""
    if not gaps:
        return dx
    here, g = w[r.X + n], w[r.GAP + n]
    return beyond(here + dx, g) - beyond(here, g)


@njit
def halfway(w: Array, n: int, moved: Any) -> Any:
    """Half-way through `moved`: hysteretic displacement z, and its slope dz/dx while loading."""
    z = w[r.Z + n]
    soft = _softness(w, n, z)
    middle = z + 0.5 * moved * (soft if z * moved > 0.0 else 1.0)
    return middle, _softness(w, n, middle)


@njit
def _softness(w: Array, n: int, z: Any) -> Any:
    """1 - |z/x_y|^n, interpolated between the powers 1, 2, 4, 8 and 16."""
    p = min(abs(z) * w[r.INVERSE_YIELD + n], 1.0)
    p2 = p * p
    p4 = p2 * p2
    p8 = p4 * p4
    low = w[r.SHARP_1 + n] * p + w[r.SHARP_2 + n] * p2 + w[r.SHARP_4 + n] * p4
    return 1.0 - low - p8 * (w[r.SHARP_8 + n] + w[r.SHARP_16 + n] * p8)


@njit
def _yielded(w: Array, n: int, moved: Any, middle: Any, soft: Any) -> Any:
    """Hysteretic displacement after `moved` (midpoint rule), and its mean slope."""
    share, limit = soft if middle * moved > 0.0 else 1.0, w[r.YIELD + n]
    return min(max(w[r.Z + n] + moved * share, -limit), limit), share


@njit
def specimen(w: Array, n: int, guess: Any, gaps: bool, yields: bool) -> Any:
    """Force and tangent of the specimen after an increment `guess`.

    Where it yields, IN_MIDDLE and IN_SOFT hold `halfway` of the guess.
    """
    g = w[r.GAP + n]
    there = w[r.X + n] + guess
    after = beyond(there, g) if gaps else there
    square, cap, ratio = after * after, w[r.HARDENING_CAP + n], w[r.YIELD_RATIO + n]
    cubic = w[r.HARDENING + n] * min(square, cap)
    force = after * (ratio + cubic)
    tangent = ratio + cubic * (3.0 if square <= cap else 1.0)
    if yields:
        moved = passed(w, n, guess, gaps)
        z, share = _yielded(w, n, moved, w[r.IN_MIDDLE + n], w[r.IN_SOFT + n])
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


@njit
def finish_yield(w: Array, n: int, dx: Any, gaps: bool) -> None:
    """Carry the hysteretic displacement z on over the step dx, with the slope of the guess."""
    moved = passed(w, n, dx, gaps)
    w[r.Z + n], _ = _yielded(w, n, moved, w[r.IN_MIDDLE + n], w[r.IN_SOFT + n])
