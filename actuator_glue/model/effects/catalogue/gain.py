"""Static gain of the command channel."""

from __future__ import annotations

from actuator_glue.jit import njit
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='gain',
    place='command',
    equation='u_c = g u',
    parameters=(
        Parameter('gain', '1', 0.7, 1.3, 'static gain of the command channel', 1.0, 'gain'),
    ),
    group='gain',
    signature='linear; relative residual constant down to zero frequency',
    source='Jelali & Kroll 2003',
    meaning='the command channel has another scale than it is said to have',
    remedy='check the scale of command and transducer in controller and recorder',
    starts=lambda s: ((1.01,), (0.99,), (1.05,), (0.95,)),
    exact=(),
    stage=Stage(adds={'gain': njit(lambda p: p.gain)}),
)
