"""First-order lag of the recorded displacement."""

from __future__ import annotations

from actuator_glue.model.effects import lti_step, rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='sensor-lag',
    place='sensor',
    equation="T y' + y = x",
    parameters=(
        Parameter('sensor_lag', 's', 0.0, 0.03, 'time constant of conditioner or filter', 0.0),
    ),
    group='lag',
    signature='linear; as a delay with a slight roll-off',
    source='Jelali & Kroll 2003 (transducers)',
    starts=lambda s: ((0.0005,), (0.002,), (0.008,)),
    switches=(rows.ON_TRANSDUCER,),
    exact=lti_step.SENSOR,
)
