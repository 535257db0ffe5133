"""A displacement that runs ahead of its recorded command."""

from __future__ import annotations

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='lead',
    place='command',
    equation='u_c(t) = u(t + tau)',
    parameters=(
        Parameter('lead', 's', 0.0, 0.03, 'time by which the record of the command is late', 0.0),
    ),
    group='lead',
    signature='linear; phase lead proportional to frequency',
    source='Horiuchi et al. 1999',
    meaning='a compensator sends the command ahead, or the two channels were not read at once',
    remedy='record the command as the controller gets it, both channels at the same instant',
    starts=lambda s: ((0.001,), (0.004,), (0.01,)),
    exact=(),
    searched=False,  # a frame's mode looks like one: only where it explains far more than all else
    stage=Stage(adds={'delay': njit(lambda p: -p.lead)}, shared=(r.ON_LAG,)),
)
