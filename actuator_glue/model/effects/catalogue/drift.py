"""Offset of the transducer that drifts."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


def _drift(p: Array, time: Array, y: Array) -> Array:
    return y + time * p[:, 0]


EFFECT = replace(
    term(
        'drift',
        'sensor: y = y + drift*t',
        (Parameter('drift', 'm/s', -5e-5, 5e-5, 'drift of the transducer offset', 0.0),),
        group='drift',
        signature='linear trend',
        source='IEEE Std 1057-2017 (drift)',
        check=False,
    ),
    starts=lambda s: (
        (0.02 * s.stroke / s.duration,),
        (-0.02 * s.stroke / s.duration,),
    ),
    output=_drift,
    meaning='the zero of the transducer wanders',
    remedy='let amplifier and transducer warm up; check cable and earth',
)
