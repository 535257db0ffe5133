"""Specimen that yields (Bouc-Wen)."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.catalogue.specimen_gap import passed
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Case, Stage
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

LIMIT, INVERSE, RATIO, Z, MIDDLE, SOFT = r.ROWS.take(6)
SHARP_1, SHARP_2, SHARP_4, SHARP_8, SHARP_16 = r.ROWS.take(5)
(ON,) = r.SWITCHES.take(1)


@njit
def _fill(w: Array, n: int, p: Any, case: Case) -> None:
    w[LIMIT + n], w[INVERSE + n] = p.yield_displacement, 1.0 / p.yield_displacement
    w[RATIO + n] = p.post_yield_ratio
    for power in range(5):  # SHARP_1 .. SHARP_16 follow one another
        w[SHARP_1 + power * r.LANES + n] = max(1.0 - abs(p.yield_sharpness - power), 0.0)


@njit
def halfway(w: Array, n: int, moved: Any) -> None:
    """Write half-way through `moved`: displacement z, and its slope dz/dx while loading."""
    z = w[Z + n]
    soft = _softness(w, n, z)
    middle = z + 0.5 * moved * (soft if z * moved > 0.0 else 1.0)
    w[MIDDLE + n], w[SOFT + n] = middle, _softness(w, n, middle)


@njit
def _softness(w: Array, n: int, z: Any) -> Any:
    """1 - |z/x_y|^n, interpolated between the powers 1, 2, 4, 8 and 16."""
    p = min(abs(z) * w[INVERSE + n], 1.0)
    p2 = p * p
    p4 = p2 * p2
    p8 = p4 * p4
    low = w[SHARP_1 + n] * p + w[SHARP_2 + n] * p2 + w[SHARP_4 + n] * p4
    return 1.0 - low - p8 * (w[SHARP_8 + n] + w[SHARP_16 + n] * p8)


@njit
def yielded(w: Array, n: int, moved: Any) -> Any:
    """Hysteretic displacement after `moved` (midpoint rule), and its mean slope."""
    soft, limit = w[SOFT + n], w[LIMIT + n]
    share = soft if w[MIDDLE + n] * moved > 0.0 else 1.0
    return min(max(w[Z + n] + moved * share, -limit), limit), share


@njit
def finish(w: Array, n: int, dx: Any, gaps: bool) -> None:
    """Carry the hysteretic displacement z on over the step dx, with the slope of the guess."""
    moved = passed(w, n, dx, gaps)
    w[Z + n], _ = yielded(w, n, moved)


EFFECT = Effect(
    name='specimen-yield',
    place='specimen',
    equation='f = k (a x + (1 - a) z), dz/dx = 1 - |z/x_y|^n while loading, 1 while unloading, '
    'n = 2^sharpness (powers between 1, 2, 4, 8, 16 interpolated)',
    parameters=(
        Parameter(
            'post_yield_ratio',
            '1',
            0.0,
            1.0,
            'stiffness after over before yield',
            1.0,
            'lost-share',
        ),
        Parameter('yield_displacement', 'm', 1e-5, 0.05, 'yield displacement', 2e-3),
        Parameter('yield_sharpness', '1', 0.0, 4.0, 'log2 of the Bouc-Wen exponent', 1.0),
    ),
    group='hysteresis',
    signature='loop with memory, area grows with amplitude; none without a specimen',
    source='Wen 1976 (beta = gamma)',
    meaning='the specimen yields',
    remedy='nothing at the actuator: it is the specimen; calibrate with one that stays elastic',
    starts=lambda s: tuple(
        (ratio, share * s.stroke, sharp)
        for ratio in (0.2, 0.7)
        for share in (0.2, 0.6)
        for sharp in (0.5, 2.5)
    ),
    stage=Stage(_fill, own=ON, shared=(r.ON_CURVED,)),
)
