"""Play between piston and transducer."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

PLAY, AT = r.ROWS.take(2)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[PLAY + n], w[AT + n] = p.backlash, case.x


@njit
def _sensed(w: Array, n: int, y: Any) -> Any:
    # In this order a position that is not a number goes through.
    at = min(y + w[PLAY + n], max(y - w[PLAY + n], w[AT + n]))
    w[AT + n] = at
    return at


EFFECT = Effect(
    name='backlash',
    place='piston',
    equation='y = play(x, b): y moves with x only while |x - y| = b',
    parameters=(
        Parameter('backlash', 'm', 0.0, 1e-3, 'play before the transducer, half width', 0.0),
    ),
    group='lost-motion',
    signature='rectangular loop against displacement, flat after reversals; size falls as 1/A',
    source='Tao & Kokotovic 1996 (play operator)',
    meaning='play in the joints between the piston and where its displacement is measured',
    remedy='check pins, clevises and the mounting of the transducer; take the play out',
    starts=lambda s: ((0.005 * s.stroke,), (0.02 * s.stroke,), (0.06 * s.stroke,)),
    stage=Stage(_fill, sensed=_sensed),
)
