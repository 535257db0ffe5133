"""Clearance at the specimen."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.dead_zone import beyond
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

(GAP,) = r.ROWS.take(1)
(ON,) = r.SWITCHES.take(1)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[GAP + n] = p.gap


@njit
def gapped(w: Array, n: int, push: Any, stiff: Any, free: Any, touched: Any) -> Any:
    """Increment against f = k D(x, g): the position at the end is a function with two kinks.

    `free` and `touched` are one over the stiffness without and with the specimen.
    """
    x, gap, dry = w[r.X + n], w[GAP + n], w[r.COULOMB + n]
    against = stiff + w[r.DAMPING_2 + n]
    trial = push - w[r.STIFFNESS + n] * beyond(x, gap)
    total = push - min(max(trial, -dry), dry) + against * x
    held = beyond(total, against * gap)
    dx = (total - held) * free + held * touched - x
    return 0.0 if abs(trial) <= dry else dx


@njit
def passed(w: Array, n: int, dx: Any, gaps: bool) -> Any:
    """Part of an increment that moves the specimen."""
    if not gaps:
        return dx
    here, g = w[r.X + n], w[GAP + n]
    return beyond(here + dx, g) - beyond(here, g)


EFFECT = Effect(
    name='specimen-gap',
    place='specimen',
    equation='f = k D(x, g), D(x, g) = sign(x) max(|x| - g, 0)',
    parameters=(Parameter('gap', 'm', 0.0, 1e-2, 'gap at the specimen, half width', 0.0),),
    group='gap',
    signature='odd; stiffness missing around zero displacement',
    source='Kerschen et al. 2006 (clearance)',
    meaning='the specimen is not touched around its middle',
    remedy='close bolts, pins and shims between actuator, load cell and specimen',
    starts=lambda s: ((0.02 * s.stroke,), (0.1 * s.stroke,), (0.3 * s.stroke,)),
    stage=Stage(_fill, own=ON),
)
