"""Effects between the transducer and the record; none of them is fed back to the valve."""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model.effects import lti, rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


def _bias(p: Array, time: Array, y: Array) -> Array:
    return y + p[:, 0]


def _drift(p: Array, time: Array, y: Array) -> Array:
    return y + time * p[:, 0]


@njit(nogil=True)
def _line(a: Array, b: Array, hertz: Array, time: Array, y: Array, out: Array) -> None:
    """Write y plus a spectral line; vector code, which the library's sine is not."""
    for i in range(y.shape[0]):
        for n in range(y.shape[1]):
            turns = hertz[n] * time[i]
            half = math.pi * (turns - math.floor(turns + 0.5))
            # Taylor series of sine and cosine up to a quarter turn, to rounding; written out,
            # since a loop inside would keep the lanes apart.
            z = half * half
            sine = 1.0 - z / 272.0 * (1.0 - z / 342.0 * (1.0 - z / 420.0))
            sine = 1.0 - z / 110.0 * (1.0 - z / 156.0 * (1.0 - z / 210.0 * sine))
            sine = 1.0 - z / 20.0 * (1.0 - z / 42.0 * (1.0 - z / 72.0 * sine))
            sine = half * (1.0 - z / 6.0 * sine)
            cosine = 1.0 - z / 240.0 * (1.0 - z / 306.0 * (1.0 - z / 380.0))
            cosine = 1.0 - z / 90.0 * (1.0 - z / 132.0 * (1.0 - z / 182.0 * cosine))
            cosine = 1.0 - z / 12.0 * (1.0 - z / 30.0 * (1.0 - z / 56.0 * cosine))
            cosine = 1.0 - z / 2.0 * cosine
            line = a[n] * (1.0 - 2.0 * sine * sine) + b[n] * (2.0 * sine * cosine)
            out[i, n] = y[i, n] + line


def _hum(p: Array, time: Array, y: Array) -> Array:
    out = np.empty(y.shape)
    a, b, hertz = np.ascontiguousarray(p.T)
    _line(a, b, hertz, np.ascontiguousarray(time[:, 0]), y, out)
    return out


def _quantisation(p: Array, velocity: Array) -> Array:
    return np.broadcast_to(p[:, :1] ** 2 / 12.0, velocity.shape)


def _jitter(p: Array, velocity: Array) -> Array:
    return np.asarray((p[:, :1] * velocity) ** 2)


LAG = Effect(
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
    exact=lti.SENSOR,
)

BIAS = Effect(
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

DRIFT = Effect(
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

HUM = Effect(
    name='hum',
    place='sensor',
    equation='y = x + a cos(2 pi f t) + b sin(2 pi f t)',
    parameters=(
        Parameter('hum_cosine', 'm', -1e-3, 1e-3, 'cosine amplitude of the line', 0.0),
        Parameter('hum_sine', 'm', -1e-3, 1e-3, 'sine amplitude of the line', 0.0),
        Parameter('hum_frequency', 'Hz', 1.0, 1000.0, 'frequency of the line', 50.0),
    ),
    group='hum',
    signature='spectral line incoherent with the command',
    source='IEEE Std 1057-2017 (sine fit)',
    starts=lambda s: (
        tuple(
            (0.001 * s.stroke, 0.001 * s.stroke, hz)
            for hz in (50.0, 60.0)
            if 2.0 * hz * s.period < 1
        )
        or ((0.001 * s.stroke, 0.001 * s.stroke, 0.2 / s.period),)
    ),
    output=_hum,
)

QUANTISATION = Effect(
    name='quantisation',
    place='sensor',
    equation='y = d round(x/d); adds the variance d^2/12',
    parameters=(Parameter('quantum', 'm', 0.0, 1e-3, 'step of the converter', 0.0),),
    group='quantisation',
    signature='values on a grid',
    source='Bennett 1948',
    starts=lambda s: ((1e-6,), (1e-5,), (5e-5,)),
    variance=_quantisation,
)

SKEW = Effect(
    name='clock-skew',
    place='sensor',
    equation='u_c(t) = u(t - eps t): the record lags more and more (eps > 0) behind the command',
    parameters=(
        Parameter('clock_skew', '1', -1e-3, 1e-3, 'relative rate error of the two clocks', 0.0),
    ),
    group='skew',
    signature='lag grows with time',
    source='Mills 1991 (frequency error of clocks)',
    starts=lambda s: ((5e-5,), (-5e-5,), (3e-4,), (-3e-4,)),
    switches=(rows.ON_LAG,),
)

JITTER = Effect(
    name='timing-jitter',
    place='sensor',
    equation='y_i = x(t_i + d_i), d_i ~ N(0, s^2); adds the variance (s v)^2',
    parameters=(Parameter('jitter', 's', 0.0, 5e-3, 'standard deviation of sample times', 0.0),),
    group='jitter',
    signature='variance proportional to velocity squared, no mean',
    source='Souders et al. 1990',
    starts=lambda s: ((1e-4,), (5e-4,)),
    variance=_jitter,
)

EFFECTS = (LAG, BIAS, DRIFT, HUM, QUANTISATION, SKEW, JITTER)
