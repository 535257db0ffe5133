"""Orifice equation: flow that depends on the load."""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

(INVERSE_STALL,) = r.ROWS.take(1)
(ON,) = r.SWITCHES.take(1)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[INVERSE_STALL + n] = p.inverse_stall_force


@njit
def _gain(w: Array, n: int, time: float) -> Any:
    load = (w[r.F + n] + 0.5 * w[r.DF + n]) * w[INVERSE_STALL + n]
    return math.sqrt(max(1.0 - (load if w[r.IN_Q + n] > 0.0 else -load), 0.0))


EFFECT = Effect(
    name='pressure-flow',
    place='flow',
    equation='Q = q sqrt(max(1 - sign(q) f/F_s, 0))',
    parameters=(
        Parameter(
            'inverse_stall_force', '1/N', 0.0, 1e-2, '1/F_s: one over supply pressure x area', 0.0
        ),
    ),
    group='pressure-flow',
    signature='odd harmonics that grow with the load; none without a specimen',
    source='Merritt 1967 (orifice equation, load pressure p_L = f/A)',
    meaning='flow falls as the load takes up supply pressure',
    remedy='raise supply pressure or take a larger actuator: load is near its limit',
    starts=lambda s: tuple(
        (share / max(s.stiffness * s.stroke, 0.2 * s.oil * s.stroke),) for share in (0.1, 0.4)
    ),
    stage=Stage(_fill, gain=_gain, own=ON),
)
