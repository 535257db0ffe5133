"""Clearance at the specimen."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='specimen-gap',
    place='specimen',
    equation='f = k D(x, g), D(x, g) = sign(x) max(|x| - g, 0)',
    parameters=(Parameter('gap', 'm', 0.0, 1e-2, 'gap at the specimen, half width', 0.0),),
    group='gap',
    signature='odd; stiffness missing around zero displacement',
    source='Kerschen et al. 2006 (clearance)',
    starts=lambda s: ((0.02 * s.stroke,), (0.1 * s.stroke,), (0.3 * s.stroke,)),
    switches=(rows.ON_GAP,),
)
