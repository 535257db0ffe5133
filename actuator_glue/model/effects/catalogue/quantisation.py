"""Steps of the converter."""

from __future__ import annotations

import numpy as np

from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


def _quantisation(p: Array, velocity: Array) -> Array:
    return np.broadcast_to(p[:, :1] ** 2 / 12.0, velocity.shape)


EFFECT = Effect(
    name='quantisation',
    place='sensor',
    equation='y = d round(x/d); adds the variance d^2/12',
    parameters=(Parameter('quantum', 'm', 0.0, 1e-3, 'step of the converter', 0.0),),
    group='quantisation',
    signature='values on a grid',
    source='Bennett 1948',
    meaning='the converter records in coarse steps',
    remedy='take a finer range or more bits, or a better transducer',
    starts=lambda s: ((1e-6,), (1e-5,), (5e-5,)),
    variance=_quantisation,
)
