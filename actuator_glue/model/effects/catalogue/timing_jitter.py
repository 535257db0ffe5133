"""Sample times that scatter."""

from __future__ import annotations

import numpy as np

from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


def _jitter(p: Array, velocity: Array) -> Array:
    return np.asarray((p[:, :1] * velocity) ** 2)


EFFECT = Effect(
    name='timing-jitter',
    place='sensor',
    equation='y_i = x(t_i + d_i), d_i ~ N(0, s^2); adds the variance (s v)^2',
    parameters=(Parameter('jitter', 's', 0.0, 5e-3, 'standard deviation of sample times', 0.0),),
    group='jitter',
    signature='variance proportional to velocity squared, no mean',
    source='Souders et al. 1990',
    meaning='samples are not taken at even times',
    remedy='record with a hardware clock; check the load of the recording computer',
    starts=lambda s: ((1e-4,), (5e-4,)),
    variance=_jitter,
)
