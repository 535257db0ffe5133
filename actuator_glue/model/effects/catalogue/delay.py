"""Transport delay of the command."""

from __future__ import annotations

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='delay',
    place='command',
    equation='u_c(t) = u(t - tau)',
    parameters=(Parameter('delay', 's', 0.0, 0.03, 'transport delay of the command', 0.0),),
    group='lag',
    signature='linear; phase error proportional to frequency',
    source='Horiuchi et al. 1999',
    meaning='the command reaches the controller late',
    remedy='check network, filters and task order of the controller; compensate the rest',
    starts=lambda s: ((0.001,), (0.004,), (0.01,)),
    exact=(),
    stage=Stage(adds={'delay': njit(lambda p: p.delay)}, shared=(r.ON_LAG,)),
)
