"""Play between piston and transducer."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

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
    starts=lambda s: ((0.005 * s.stroke,), (0.02 * s.stroke,), (0.06 * s.stroke,)),
    switches=(rows.ON_TRANSDUCER,),
)
