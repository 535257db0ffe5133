"""Viscous damping beside the specimen."""

from __future__ import annotations

from actuator_glue.jit import njit
from actuator_glue.model.effects import linear_step
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='viscous-damping',
    place='specimen',
    equation='f = k x + c v',
    parameters=(Parameter('damping', 'N s/m', 0.0, 2e5, 'viscous damping', 0.0, 'damping'),),
    group='gain',
    signature='linear; absorbed by the base parameters unless two stiffnesses are known',
    source='Dyke et al. 1995',
    meaning='the specimen, or a damper beside it, resists with speed',
    remedy='nothing at the actuator: declare it with --effect, or calibrate without it',
    starts=lambda s: tuple(
        (share * s.oil * s.stroke / s.velocity,) for share in (0.01, 0.05, 0.3)
    ),
    exact=linear_step.VELOCITY,
    stage=Stage(adds={'damping': njit(lambda p: p.damping)}),
)
