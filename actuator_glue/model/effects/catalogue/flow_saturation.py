"""Flow limited to what the valve is rated for."""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

(LIMIT,) = r.ROWS.take(1)

NO_LIMIT = 2.0  # m/s; at or above it nothing is limited


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    velocity = p.saturation_velocity
    w[LIMIT + n] = math.inf if velocity >= NO_LIMIT else velocity * p.alpha_2


@njit
def _limit(w: Array, n: int, flow: Any, slope: Any) -> Any:
    limit = w[LIMIT + n]
    return min(max(flow, -limit), limit), (slope if abs(flow) <= limit else 0.0)


EFFECT = Effect(
    name='flow-saturation',
    place='flow',
    equation='Q = clip(q, -alpha_2 v_max, alpha_2 v_max)',
    parameters=(
        Parameter(
            'saturation_velocity',
            'm/s',
            1e-3,
            NO_LIMIT,
            'free piston velocity at rated flow',
            NO_LIMIT,
            'flow',
        ),
    ),
    group='saturation',
    signature='odd harmonics above an onset in velocity',
    source='Merritt 1967; Jelali & Kroll 2003',
    meaning='the valve gives no more flow than it is rated for',
    remedy='command less speed, or take a larger valve or two',
    starts=lambda s: ((0.95 * s.velocity,), (0.75 * s.velocity,), (0.5 * s.velocity,)),
    stage=Stage(_fill, limit=_limit),
)
