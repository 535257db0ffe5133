"""Flow gain that differs between out and in."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

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
    starts=lambda s: ((0.03,), (-0.03,), (0.15,), (-0.15,)),
    switches=(rows.ON_FLOW,),
)
