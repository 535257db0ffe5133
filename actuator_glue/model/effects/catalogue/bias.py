"""Offset of the transducer."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


def _bias(p: Array, time: Array, y: Array) -> Array:
    return y + p[:, 0]


EFFECT = replace(
    term(
        'bias',
        'sensor: y = y + bias',
        (Parameter('bias', 'm', -2e-3, 2e-3, 'offset of the transducer', 0.0),),
        group='offset',
        signature='constant offset',
        source='IEEE Std 1057-2017 (offset error)',
        check=False,
    ),
    starts=lambda s: ((0.02 * s.stroke,), (-0.02 * s.stroke,)),
    output=_bias,
    meaning='the zero of the transducer is off',
    remedy='zero the transducer before the test',
)
