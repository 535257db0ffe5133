"""Overlap of the spool: a dead band of the control error."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.dead_zone import beyond
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

(BAND,) = r.ROWS.take(1)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[BAND + n] = p.deadband


@njit
def _error(w: Array, n: int, error: Any, slope: Any) -> Any:
    band = w[BAND + n]
    return beyond(error, band), (slope if abs(error) >= band else 0.0)


EFFECT = Effect(
    name='valve-deadband',
    place='valve',
    equation='e = D(u_c - x, w), D(e, w) = sign(e) max(|e| - w, 0)',
    parameters=(
        Parameter('deadband', 'm', 0.0, 2e-3, 'overlap as control error, half width', 0.0),
    ),
    group='lost-motion',
    signature='odd harmonics; flat where the velocity is small; relative size falls as 1/A',
    source='Merritt 1967; Tao & Kokotovic 1996',
    meaning='the spool overlaps its ports: small errors move nothing',
    remedy='have the servo-valve checked for overlap; a dither or compensation in the controller',
    starts=lambda s: ((0.005 * s.stroke,), (0.02 * s.stroke,), (0.06 * s.stroke,)),
    stage=Stage(_fill, error=_error),
)
