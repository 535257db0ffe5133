"""Specimen whose stiffness changes with displacement."""

from __future__ import annotations

import math
from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

HARDENING, CAP = r.ROWS.take(2)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[HARDENING + n] = p.hardening
    # Past the peak of a softening spring (3 |kappa| x^2 = 1) the secant stays.
    w[CAP + n] = -1.0 / (3.0 * p.hardening) if p.hardening < 0.0 else math.inf


@njit
def cubic(w: Array, n: int, x: Any) -> Any:
    """What hardening adds to secant and tangent stiffness at x, over the stiffness."""
    square, cap = x * x, w[CAP + n]
    added = w[HARDENING + n] * min(square, cap)
    return added, added * (3.0 if square <= cap else 1.0)


EFFECT = Effect(
    name='specimen-hardening',
    place='specimen',
    equation='f = k x (1 + kappa x^2); past the peak of a softening curve the secant 2/3 stays',
    parameters=(
        Parameter('hardening', '1/m^2', -3e5, 3e6, 'cubic stiffness over stiffness', 0.0, 'share'),
    ),
    group='hardening',
    signature='odd harmonics; relative size grows as A^2',
    source='Kerschen et al. 2006 (Duffing)',
    meaning='the specimen is stiffer or softer at large displacement',
    remedy='nothing at the actuator: it is the specimen; use a linear one to calibrate',
    starts=lambda s: tuple((share / s.stroke**2,) for share in (0.1, -0.1, 0.5)),
    stage=Stage(_fill, shared=(r.ON_CURVED,)),
)
