"""Flow gain that differs between out and in."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

(ASYMMETRY,) = r.ROWS.take(1)
(ON,) = r.SWITCHES.take(1)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[ASYMMETRY + n] = p.asymmetry


@njit
def _gain(w: Array, n: int, time: float) -> Any:
    side = w[ASYMMETRY + n] if w[r.IN_Q + n] > 0.0 else -w[ASYMMETRY + n]
    return 1.0 + side


EFFECT = Effect(
    name='flow-asymmetry',
    place='flow',
    equation='Q = q (1 + a sign(q))',
    parameters=(
        Parameter(
            'asymmetry', '1', -0.6, 0.6, 'flow gain out against in, half the difference', 0.0
        ),
    ),
    group='asymmetry',
    signature='even harmonics and a mean that follows the velocity',
    source='Jelali & Kroll 2003 (single-rod cylinder)',
    meaning='the actuator is stronger one way than the other',
    remedy='a single-rod cylinder is so; for others check the valve for a worn edge and the null',
    starts=lambda s: ((0.03,), (-0.03,), (0.15,), (-0.15,)),
    stage=Stage(_fill, gain=_gain, own=ON),
)
