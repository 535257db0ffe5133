"""Dry friction that falls with velocity."""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

EXTRA, BEND, LAG, LEVEL, BELL, REACH, FALL = r.ROWS.take(7)
(ON,) = r.SWITCHES.take(1)
# The rise of dry friction follows a change of velocity with this time constant (frictional
# memory), or with MARGIN rise / ((k + alpha_2) v_s) where that is longer: the steepest fall of
# the Stribeck curve is 0.86 rise / v_s, and a massless specimen has one velocity only where the
# memory is longer than 0.86 rise / ((k + alpha_2) v_s).
MEMORY = 2e-3  # s
MARGIN = 1.72
# Taylor series of exp(-t/64).
_BELL_1, _BELL_2, _BELL_3, _BELL_4 = (64.0**-i / math.factorial(i) for i in range(1, 5))


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    extra, speed = p.sliding_force * (p.breakaway_ratio - 1.0), p.stribeck_velocity
    memory = max(MEMORY, MARGIN * extra / ((case.k + p.alpha_2) * speed))
    w[LAG + n] = math.exp(-case.step / memory)
    w[EXTRA + n] = extra * (1.0 - w[LAG + n])
    w[BEND + n] = 2.0 / (case.step * case.step * speed * speed)
    w[BELL + n] = math.exp(-0.5 * w[BEND + n] * (case.v * case.step) ** 2)


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
def first(w: Array, n: int, push: Any, touched: Any) -> None:
    """Size of the increment against f = k x and falling friction: a Newton step from the last.

    The size is REACH if friction does not rise again, less FALL where it rises fully.
    """
    trial = push - w[r.STIFFNESS + n] * w[r.X + n]
    level = w[LEVEL + n] * w[LAG + n]
    reach = (abs(trial) - w[r.COULOMB + n] - level) * touched
    fall = w[EXTRA + n] * touched
    w[LEVEL + n], w[REACH + n], w[FALL + n] = level, reach, fall
    guess = abs(w[r.DX + n])
    bend = w[BEND + n] * guess
    w[r.IN_DX + n] = _newton(reach, fall * w[BELL + n], guess, bend)


@njit
def following(w: Array, n: int) -> None:
    """Another Newton step."""
    guess = w[r.IN_DX + n]
    bend = w[BEND + n] * guess
    taken = w[FALL + n] * bell(bend * guess)
    w[r.IN_DX + n] = _newton(w[REACH + n], taken, guess, bend)


@njit
def _newton(reach: Any, taken: Any, guess: Any, bend: Any) -> Any:
    """Newton step on size = reach - taken(size): its slope is at most 1/2, which saves a division.

    See MARGIN.
    """
    slope = bend * taken
    missing = reach - taken - guess
    return max(guess + missing * (1.0 + slope + slope * slope), 0.0)


@njit
def last(w: Array, n: int, push: Any) -> Any:
    """The increment with its sign; friction rises to its level at the end of the step."""
    size = w[r.IN_DX + n]
    rise = bell(w[BEND + n] * size * size)
    w[LEVEL + n] += w[EXTRA + n] * rise
    w[BELL + n] = rise
    return size if push - w[r.STIFFNESS + n] * w[r.X + n] > 0.0 else -size


@njit
def rise(w: Array, n: int, dx: Any) -> Any:
    """Rise of dry friction over its sliding value at the end of a step by dx."""
    share = bell(w[BEND + n] * dx * dx)
    return w[LEVEL + n] * w[LAG + n] + w[EXTRA + n] * share


EFFECT = Effect(
    name='stribeck-friction',
    place='piston',
    equation="f = f_specimen + F sign(v), T_m F' + F = F_c (1 + (r - 1) exp(-(v/v_s)^2)), "
    'T_m = max(2 ms, 1.72 (r - 1) F_c/((k + alpha_2) v_s))',
    parameters=(
        Parameter(
            'sliding_force', 'N', 0.0, 2e4, 'dry friction when sliding fast', 0.0, 'sliding-force'
        ),
        Parameter('breakaway_ratio', '1', 1.0, 4.0, 'break-away over sliding friction', 1.5),
        Parameter('stribeck_velocity', 'm/s', 5e-4, 0.1, 'Stribeck velocity', 0.01),
    ),
    group='friction',
    signature='as Coulomb friction, with stick-slip at reversals',
    source='Armstrong-Helouvry et al. 1994 (Stribeck curve, frictional memory)',
    meaning='seals or guides stick before they slide',
    remedy='check seals, lubrication and side load; a dither helps',
    starts=lambda s: tuple(
        (share * s.oil * s.stroke, ratio, speed)
        for share in (0.005, 0.02, 0.08)
        for ratio, speed in ((1.5, 0.005), (2.0, 0.03))
    ),
    holds=('coulomb-friction', 'breakaway_ratio', 1.0),
    stage=Stage(_fill, adds={'dry': njit(lambda p: p.sliding_force)}, own=ON),
)
