"""Effects between the recorded command and the summing junction."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

DELAY = Effect(
    name='delay',
    place='command',
    equation='u_c(t) = u(t - tau)',
    parameters=(Parameter('delay', 's', 0.0, 0.03, 'transport delay of the command', 0.0),),
    group='lag',
    signature='linear; phase error proportional to frequency',
    source='Horiuchi et al. 1999',
    starts=lambda s: ((0.001,), (0.004,), (0.01,)),
    switches=(rows.ON_LAG,),
    exact=(),
)

GAIN = Effect(
    name='gain',
    place='command',
    equation='u_c = g u',
    parameters=(Parameter('gain', '1', 0.7, 1.3, 'static gain of the command channel', 1.0),),
    group='gain',
    signature='linear; relative residual constant down to zero frequency',
    source='Jelali & Kroll 2003',
    starts=lambda s: ((1.01,), (0.99,), (1.05,), (0.95,)),
    exact=(),
)

EFFECTS = (DELAY, GAIN)
