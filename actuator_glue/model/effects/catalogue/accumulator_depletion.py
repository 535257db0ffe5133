"""Supply pressure that falls while more flow is drawn than the pump gives."""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

LOSS, PUMP, INVERSE_ALPHA_2, LOST = r.ROWS.take(4)
(ON,) = r.SWITCHES.take(1)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[LOSS + n], w[PUMP + n] = p.depletion * case.step, p.pump_velocity
    w[INVERSE_ALPHA_2 + n] = 1.0 / p.alpha_2
    w[LOST + n] = 0.0


@njit
def _gain(w: Array, n: int, time: float) -> Any:
    before, speed = w[LOST + n], abs(w[r.IN_Q + n]) * w[INVERSE_ALPHA_2 + n]
    drawn = math.sqrt(1.0 - before) * speed
    middle = min(max(before + 0.5 * w[LOSS + n] * (drawn - w[PUMP + n]), 0.0), 1.0)
    gain = math.sqrt(1.0 - middle)
    w[LOST + n] = min(max(before + w[LOSS + n] * (gain * speed - w[PUMP + n]), 0.0), 1.0)
    return gain


EFFECT = Effect(
    name='accumulator-depletion',
    place='flow',
    equation="Q = q sqrt(1 - w), w' = c (|Q|/alpha_2 - v) between 0 and 1",
    parameters=(
        Parameter(
            'depletion', '1/m', 0.0, 200.0, 'supply pressure lost per stroke beyond the pump', 0.0
        ),
        Parameter('pump_velocity', 'm/s', 0.0, 2.0, 'velocity that the pump can keep up', 0.0),
    ),
    group='flow-time',
    signature='gain falls in strong motion that lasts, and comes back at a constant rate',
    source='Merritt 1967 (constant-pressure supplies with accumulator)',
    meaning='the motion draws more oil than the pump gives, and the accumulators run empty',
    remedy='add or recharge accumulators, or command smaller or shorter motion',
    starts=lambda s: tuple(
        (1.0 / (time * s.velocity), share * s.velocity)
        for share in (0.1, 0.3, 0.6)
        for time in (1.0, 10.0)
    ),
    stage=Stage(_fill, gain=_gain, own=ON),
    record_time=True,
)
