"""First-order lag of the recorded displacement."""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects import linear_step
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

LAG, DECAY, SENSED, LAST, LAST_DX = r.ROWS.take(5)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[LAG + n], w[DECAY + n] = p.sensor_lag / case.step, math.exp(-case.step / p.sensor_lag)
    w[SENSED + n], w[LAST + n], w[LAST_DX + n] = case.x, case.x, case.v * case.step


@njit
def _sensed(w: Array, n: int, y: Any) -> Any:
    """First-order lag of the parabola through the last three positions."""
    before, lag = w[LAST + n], w[LAG + n]
    moved = y - before
    bend = 0.5 * (moved - w[LAST_DX + n])
    end = y - lag * (moved + bend - 2.0 * lag * bend)
    first = before - lag * (moved - bend - 2.0 * lag * bend)
    sensed = end + w[DECAY + n] * (w[SENSED + n] - first)
    w[SENSED + n], w[LAST + n], w[LAST_DX + n] = sensed, y, moved
    return sensed


EFFECT = Effect(
    name='sensor-lag',
    place='sensor',
    equation="T y' + y = x",
    parameters=(
        Parameter('sensor_lag', 's', 0.0, 0.03, 'time constant of conditioner or filter', 0.0),
    ),
    group='lag',
    signature='linear; as a delay with a slight roll-off',
    source='Jelali & Kroll 2003 (transducers)',
    meaning='transducer, amplifier or filter lag behind the piston',
    remedy='raise the cut-off of the filter, the same one on both channels',
    starts=lambda s: ((0.0005,), (0.002,), (0.008,)),
    exact=linear_step.SENSOR,
    stage=Stage(_fill, sensed=_sensed),
)
