"""What the model does to a sine: gain, phase, delay and bandwidth, as a control engineer asks.

The model has effects that are not linear, so that it is run: sines of the amplitude that the test
reached at that frequency, and the first harmonic of what comes out (describing function).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.json_value import Json, json_value
from actuator_glue.model.effects import Scale
from actuator_glue.records import Array, Record

FREQUENCIES = (1.0, 2.0, 5.0, 10.0)  # Hz
_HIGHEST = 60.0  # Hz
_GRID = 16
# Samples per period and per second, at least: with a quarter of these the steps of a simulation
# with play are 2 us of delay, a third of what long records leave open.
_RATE = 100.0
_SLOWEST = 1024.0
_SETTLE = 2.0  # s
_PERIODS = 3
_HALF_POWER = 1.0 / math.sqrt(2.0)


@dataclass(frozen=True, slots=True)
class Sine:
    """Answer to one frequency.

    Attributes:
        frequency: [Hz].
        amplitude: of the command [m].
        gain: amplitude of the displacement over it, with its 95 % interval.
        gain_ci: (lower, upper).
        phase: lead [degrees].
        phase_ci: (lower, upper).
        delay: -phase over frequency [s].
        delay_ci: (lower, upper).
    """

    frequency: float
    amplitude: float
    gain: float
    gain_ci: tuple[float, float]
    phase: float
    phase_ci: tuple[float, float]
    delay: float
    delay_ci: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Response:
    """Frequency response of a model under one stiffness.

    Attributes:
        stiffness: of the specimen [N/m].
        sines: answers at `FREQUENCIES`.
        bandwidth: frequency at which the gain falls below 0.71 of that at 1 Hz for good [Hz];
            NaN where it does not below 60 Hz.
    """

    stiffness: float
    sines: tuple[Sine, ...]
    bandwidth: float

    def to_json(self) -> Json:
        """Return the JSON object."""
        rows = [
            {
                'frequency_hz': s.frequency,
                'amplitude': s.amplitude,
                'gain': json_value(s.gain),
                'gain_ci': [json_value(v) for v in s.gain_ci],
                'phase_deg': json_value(s.phase),
                'phase_ci': [json_value(v) for v in s.phase_ci],
                'delay_s': json_value(s.delay),
                'delay_ci': [json_value(v) for v in s.delay_ci],
            }
            for s in self.sines
        ]
        return {
            'stiffness': self.stiffness,
            'bandwidth_hz': json_value(self.bandwidth),
            'at': rows,
        }


def of(model: Model, theta: Array, draws: Array, scale: Scale, stiffness: float) -> Response:
    """Return the response of a model.

    Args:
        model: Eq. (2) with effects.
        theta: best parameters (p,).
        draws: posterior draws (m, p), for the intervals.
        scale: stroke and speed of the test: no sine exceeds either.
        stiffness: of the specimen [N/m].
    """
    table = np.concatenate([theta[None], draws])
    whole = phases(model, theta, scale, FREQUENCIES, stiffness)
    sines = []
    for hertz, turned in zip(FREQUENCIES, whole, strict=True):
        size = amplitude_of(scale, hertz)
        answer = harmonic(model, table, size, hertz, stiffness)
        gain, phase = np.abs(answer), near(np.angle(answer), turned)
        turns = np.degrees(phase)
        delay = -phase / (2.0 * math.pi * hertz)
        sines.append(
            Sine(
                hertz, size, float(gain[0]), _interval(gain[1:]), float(turns[0]),
                _interval(turns[1:]), float(delay[0]), _interval(delay[1:]),
            )
        )  # fmt: skip
    return Response(stiffness, tuple(sines), _bandwidth(model, theta, scale, stiffness))


def _interval(values: Array) -> tuple[float, float]:
    if not len(values):
        return math.nan, math.nan
    low, high = np.nanquantile(values, [0.025, 0.975])
    return float(low), float(high)


def amplitude_of(scale: Scale, hertz: float) -> float:
    """Return the largest amplitude of a sine within the stroke and speed of a test [m]."""
    return min(scale.stroke, scale.velocity / (2.0 * math.pi * hertz))


def phases(
    model: Model, theta: Array, scale: Scale, frequencies: Sequence[float], stiffness: float
) -> list[float]:
    """Return the phase (lead) of a model's sines with all its turns [rad].

    Up a ladder of frequencies from 1 Hz or the lowest asked for, where no actuator is late by
    three quarters of a turn: from one rung to the next a delay turns the phase in proportion to
    frequency, and what else there is by less than half a turn.

    Args:
        model: Eq. (2) with effects.
        theta: parameters (p,).
        scale: stroke and speed of the test.
        frequencies: ascending [Hz].
        stiffness: of the specimen [N/m].
    """
    low = min(FREQUENCIES[0], *frequencies)
    rungs = np.geomspace(
        low, frequencies[-1], 1 + math.ceil(4.0 * math.log(frequencies[-1] / low))
    )
    ladder = sorted({*map(float, rungs), *frequencies})
    found: dict[float, float] = {}
    expected = -0.5 * math.pi
    for hertz, after in zip(ladder, [*ladder[1:], ladder[-1]], strict=True):
        size = amplitude_of(scale, hertz)
        angle = np.angle(harmonic(model, theta[None], size, hertz, stiffness))
        found[hertz] = float(near(angle, expected)[0])
        expected = found[hertz] * after / hertz
    return [found[hertz] for hertz in frequencies]


def near(angles: NDArray[Any], expected: float) -> Array:
    """Return angles less than half a turn from an expected one, whole turns added [rad]."""
    return np.asarray(expected + np.angle(np.exp(1j * (angles - expected))))


def harmonic(model: Model, table: Array, size: float, hertz: float, stiffness: float) -> Array:
    """Complex gain (m,) of the first harmonic of a sine, from simulations that have settled.

    Args:
        model: Eq. (2) with effects.
        table: its parameters (m, p).
        size: amplitude of the sine of command [m].
        hertz: its frequency [Hz].
        stiffness: of the specimen [N/m].
    """
    period = 1.0 / max(_SLOWEST, _RATE * hertz)
    before = math.ceil(_SETTLE * hertz)
    per = round(1.0 / hertz / period)
    period = 1.0 / hertz / per
    time = np.arange((before + _PERIODS) * per) * period
    turn = np.exp(-2j * math.pi * hertz * time)
    record = Record(-size * turn.imag, np.zeros(len(time)), period, stiffness, hold='linear')
    out = np.atleast_2d(model.simulate(table, record))[:, -_PERIODS * per :]
    last = turn[-_PERIODS * per :]
    with np.errstate(all='ignore'):
        return np.asarray(2j * (out @ last) / (_PERIODS * per) / size)


def _bandwidth(model: Model, theta: Array, scale: Scale, stiffness: float) -> float:
    grid = np.geomspace(FREQUENCIES[0], _HIGHEST, _GRID)
    gains = np.array(
        [
            abs(harmonic(model, theta[None], amplitude_of(scale, f), float(f), stiffness)[0])
            for f in grid
        ]
    )
    level = _HALF_POWER * gains[0]
    above = np.flatnonzero(gains >= level)
    last = int(above[-1]) if len(above) else 0
    if last == _GRID - 1 or not np.isfinite(gains).all():
        return math.nan
    a, b = np.log(gains[last]), np.log(max(gains[last + 1], 1e-12))
    share = (a - math.log(level)) / max(a - b, 1e-12)
    return float(np.exp(np.log(grid[last]) + share * np.log(grid[last + 1] / grid[last])))
