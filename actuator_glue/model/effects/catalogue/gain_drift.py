"""Flow gain that drifts as the oil warms."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

(DRIFT,) = r.ROWS.take(1)
(ON,) = r.SWITCHES.take(1)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[DRIFT + n] = p.gain_drift


@njit
def _gain(w: Array, n: int, time: float) -> Any:
    return max(1.0 + w[DRIFT + n] * time, 0.0)


EFFECT = Effect(
    name='gain-drift',
    place='flow',
    equation='Q = q max(1 + r t, 0), t from the start of the record',
    parameters=(
        Parameter(
            'gain_drift', '1/s', -0.05, 0.05, 'relative change of flow gain with oil heating', 0.0
        ),
    ),
    group='flow-time',
    signature='parameters trend with time, not with amplitude',
    source='Jelali & Kroll 2003 (viscosity and bulk modulus against temperature)',
    meaning='flow gain changes as the oil warms',
    remedy='warm the oil up before the test and keep its temperature',
    starts=lambda s: ((0.05 / s.duration,), (-0.05 / s.duration,), (0.2 / s.duration,)),
    record_time=True,
    stage=Stage(_fill, gain=_gain, own=ON),
)
