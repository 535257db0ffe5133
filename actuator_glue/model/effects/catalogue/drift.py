"""Offset of the transducer that drifts."""

from __future__ import annotations

from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


def _drift(p: Array, time: Array, y: Array) -> Array:
    return y + time * p[:, 0]


EFFECT = Effect(
    name='drift',
    place='sensor',
    equation='y = x + d t, t from the start of the record',
    parameters=(Parameter('drift', 'm/s', -5e-5, 5e-5, 'drift of the transducer offset', 0.0),),
    group='drift',
    signature='linear trend',
    source='IEEE Std 1057-2017 (drift)',
    starts=lambda s: (
        (0.02 * s.stroke / s.duration,),
        (-0.02 * s.stroke / s.duration,),
    ),
    output=_drift,
)
