"""Spectral line in the record."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array


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


_TURN = '(2*pi*hum_frequency*t)'
EFFECT = replace(
    term(
        'hum',
        f'sensor: y = y + hum_cosine*cos{_TURN} + hum_sine*sin{_TURN}',
        (
            Parameter('hum_cosine', 'm', -1e-3, 1e-3, 'cosine amplitude of the line', 0.0, 'line'),
            Parameter('hum_sine', 'm', -1e-3, 1e-3, 'sine amplitude of the line', 0.0),
            Parameter('hum_frequency', 'Hz', 1.0, 1000.0, 'frequency of the line', 50.0),
        ),
        group='hum',
        signature='spectral line incoherent with the command',
        source='IEEE Std 1057-2017 (sine fit)',
        check=False,
    ),
    starts=lambda s: (
        tuple(
            (0.001 * s.stroke, 0.001 * s.stroke, hz)
            for hz in (50.0, 60.0)
            if 2.0 * hz * s.period < 1
        )
        or ((0.001 * s.stroke, 0.001 * s.stroke, 0.2 / s.period),)
    ),
    output=_hum,
    meaning='a line of the mains, a pump or a motor is in the record',
    remedy='check earth, shields and cables; a notch filter on the recorded channel',
)
