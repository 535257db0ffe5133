"""Supply pressure that falls with the mean flow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array, Record

DROOP, HALF, INVERSE_ALPHA_2, ENVELOPE = r.ROWS.take(4)
(ON,) = r.SWITCHES.take(1)


class _Envelope:
    """Speed averaged over the supply's time constant, at the first sample of a moving record.

    The motion before the record is unknown; what follows its beginning stands for it, seen
    backwards. That is right where the motion changes little within a time constant.

    Args:
        record: measured displacement and period are used.
    """

    _TIMES = np.geomspace(1e-3, 1e3, 61)  # s

    def __init__(self, record: Record) -> None:
        # Over 20 ms: sensor noise must not pass for speed.
        gap = min(max(1, round(0.02 / record.period)), len(record) - 1)
        speed = np.abs(record.measured[gap:] - record.measured[:-gap]) / (gap * record.period)
        # The shortest time constant is 20 ms: a quarter of that shows what is averaged.
        every = max(1, int(0.005 / record.period))
        speed = speed[: len(speed) // every * every].reshape(-1, every).mean(axis=1)
        time = every * record.time[: len(speed)]
        weight = np.exp(-time[np.newaxis] / self._TIMES[:, np.newaxis])
        self._speeds = (weight @ speed) / weight.sum(axis=1)

    def __call__(self, values: Mapping[str, Array], origin: float) -> dict[str, Array]:
        """Return the averaged speed [m/s] of each parameter set."""
        at = np.log(values['droop_time'])
        return {'envelope': np.interp(at, np.log(self._TIMES), self._speeds)}


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    half = 0.5 * case.step
    w[DROOP + n], w[HALF + n] = p.droop, half / (p.droop_time + half)
    w[INVERSE_ALPHA_2 + n] = 1.0 / p.alpha_2
    # Of flow over alpha_2, as in the equation.
    w[ENVELOPE + n] = p.envelope * (case.k + p.alpha_2) / p.alpha_2


@njit
def _gain(w: Array, n: int, time: float) -> Any:
    before = w[ENVELOPE + n]
    speed = abs(w[r.IN_Q + n]) * w[INVERSE_ALPHA_2 + n]
    middle = before + w[HALF + n] * (speed - before)
    w[ENVELOPE + n] = 2.0 * middle - before
    return math.sqrt(max(1.0 - w[DROOP + n] * middle, 0.0))


EFFECT = Effect(
    name='supply-droop',
    place='flow',
    equation="Q = q sqrt(max(1 - d w, 0)), T w' + w = |q|/alpha_2",
    parameters=(
        Parameter(
            'droop', 's/m', 0.0, 20.0, 'supply pressure lost per mean velocity', 0.0, 'per-flow'
        ),
        Parameter(
            'droop_time', 's', 0.02, 20.0, 'time constant of accumulator and pump', 0.5, 'log'
        ),
    ),
    group='flow-time',
    signature='gain follows the envelope of the flow',
    source='Merritt 1967 (constant-pressure supplies with accumulator)',
    meaning='supply pressure falls while much oil is used',
    remedy='check accumulators and pump, and what else draws from the supply',
    starts=lambda s: tuple(
        (share / s.velocity, time) for share in (0.05, 0.25) for time in (0.2, 1.0, 5.0)
    ),
    onset=lambda record: None if record is None else _Envelope(record),
    states=('envelope',),
    stage=Stage(_fill, gain=_gain, own=ON),
)
