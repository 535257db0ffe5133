"""Offset of the transducer."""

from __future__ import annotations

from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


def _bias(p: Array, time: Array, y: Array) -> Array:
    return y + p[:, 0]


EFFECT = Effect(
    name='bias',
    place='sensor',
    equation='y = x + b',
    parameters=(Parameter('bias', 'm', -2e-3, 2e-3, 'offset of the transducer', 0.0),),
    group='offset',
    signature='constant offset',
    source='IEEE Std 1057-2017 (offset error)',
    starts=lambda s: ((0.02 * s.stroke,), (-0.02 * s.stroke,)),
    output=_bias,
)
