"""Reaction frame that gives way to the actuator's force, with a mode of its own."""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

# State after a step from the state before, compliance, time by which the frame follows a ramp of
# the force, share of its motion that the transducer sees, one over the step.
WW, WV, VW, VV, COMPLIANCE, LATE, SEEN, RATE = r.ROWS.take(8)
# Its motion and velocity; the force at the beginning of the step, and by how much it was moved.
W, VELOCITY, BEFORE, SHIFT = r.ROWS.take(4)

# Hz, to the width of a peak apart: a fit does not move a mode much further.
_SEEN_AT = tuple(5.0 * 1.15**i for i in range(16))


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    turn = 2.0 * math.pi * p.frame_frequency
    damped = turn * math.sqrt(max(1.0 - p.frame_damping**2, 1e-12))
    left = math.exp(-p.frame_damping * turn * case.step)
    cosine = left * math.cos(damped * case.step)
    sine = left * math.sin(damped * case.step) / damped
    w[WW + n], w[WV + n] = cosine + p.frame_damping * turn * sine, sine
    w[VW + n], w[VV + n] = -turn * turn * sine, cosine - p.frame_damping * turn * sine
    w[COMPLIANCE + n], w[LATE + n] = p.frame_compliance, 2.0 * p.frame_damping / turn
    w[SEEN + n], w[RATE + n] = p.frame_seen, 1.0 / case.step
    w[W + n] = p.frame_compliance * case.k * case.x
    w[VELOCITY + n] = p.frame_compliance * case.k * case.v


@njit
def _moved(w: Array, n: int, first: Any, last: Any) -> Any:
    """Motion and velocity of the frame after a step in which the force runs from first to last."""
    soft = w[COMPLIANCE + n]
    slope = soft * (last - first) * w[RATE + n]
    follows = slope * w[LATE + n]
    off, speed = w[W + n] - soft * first + follows, w[VELOCITY + n] - slope
    end = w[WW + n] * off + w[WV + n] * speed + soft * last - follows
    return end, w[VW + n] * off + w[VV + n] * speed + slope


@njit
def _beyond(w: Array, n: int) -> Any:
    """Let the oil feel the frame that gives way, and return its motion in the middle of the step.

    The force at the end is extrapolated: the frame, which is heavy, feels a sixth of (omega h)^2
    of the error of that. What the oil loses is taken from the force at the beginning, and from
    what balances it there.
    """
    first = w[r.F + n]
    end, _ = _moved(w, n, first, first + w[r.DF + n])
    shift = -(w[r.FORCE_X + n] / w[r.FORCE_F + n]) * (end - w[W + n])
    w[BEFORE + n], w[SHIFT + n] = first, shift
    w[r.F + n] = first + shift
    w[r.R + n] += shift
    return 0.5 * (w[W + n] + end)


@njit
def _sensed(w: Array, n: int, y: Any) -> Any:
    end, speed = _moved(w, n, w[BEFORE + n], w[r.F + n])
    w[W + n], w[VELOCITY + n] = end, speed
    w[r.DF + n] += w[SHIFT + n]
    return y + w[SEEN + n] * end


EFFECT = Effect(
    name='frame-mode',
    place='specimen',
    equation=(
        "e = u_c - (x + w), f' = Q - alpha_3 f - alpha_2 (v + w'), y = x + s w, "
        "w''/omega^2 + 2 zeta w'/omega + w = c f"
    ),
    parameters=(
        Parameter('frame_compliance', 'm/N', 0.0, 2e-6, 'static compliance of the frame', 0.0),
        Parameter('frame_frequency', 'Hz', 3.0, 100.0, 'natural frequency of the frame', 25.0),
        Parameter('frame_damping', '1', 0.002, 0.5, 'damping ratio of the frame', 0.03),
        Parameter(
            'frame_seen',
            '1',
            0.0,
            1.0,
            'share of its motion in the record: 0 against the ground, 1 against the cylinder',
            0.0,
        ),
    ),
    group='inertia',
    signature='linear; pole and zero close together at the mode of the frame',
    source='Dyke et al. 1995 (structures the actuator reacts against)',
    meaning='the reaction frame gives way and swings',
    remedy='measure displacement relative to the specimen; stiffen the frame and its anchors',
    starts=lambda s: tuple(
        (min(0.05 / max(s.stiffness, 0.1 * s.oil), 2e-6), hz, 0.05, seen)
        for hz in _SEEN_AT
        for seen in (0.0, 1.0)
    ),
    reserved=True,  # seldom within reach (docs/diagnosis.md)
    stage=Stage(_fill, beyond=_beyond, sensed=_sensed, shared=(r.ON_BEYOND,)),
)
