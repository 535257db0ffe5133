"""Specimen that yields (Bouc-Wen)."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

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
    starts=lambda s: tuple(
        (ratio, share * s.stroke, sharp)
        for ratio in (0.2, 0.7)
        for share in (0.2, 0.6)
        for sharp in (0.5, 2.5)
    ),
    switches=(rows.ON_CURVED, rows.ON_YIELD),
)
