"""Controller that closes its loop on the recorded transducer."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[r.FEEDBACK + n] = p.feedback_share


EFFECT = Effect(
    name='sensor-feedback',
    place='sensor',
    equation='e = u_c - (x + s (y - x)), y what the other effects make of the recorded transducer',
    parameters=(
        Parameter(
            'feedback_share', '1', 0.0, 1.0, 'share of the recorded transducer in the loop', 0.0
        ),
    ),
    group='feedback',
    signature='none alone; sensor effects move the piston, too',
    source='Jelali & Kroll 2003 (transducers)',
    meaning='the controller closes its loop on the recorded transducer',
    remedy='nothing is wrong: it says which transducer the loop is closed on',
    starts=lambda s: ((1.0,),),
    searched=False,  # alone it has no effect
    stage=Stage(_fill, shared=(r.ON_BEYOND, r.ON_FEEDBACK)),
)
