"""Null bias of the valve."""

from __future__ import annotations

from actuator_glue.jit import njit
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='valve-null',
    place='valve',
    equation='e = u_c - x + e_0',
    parameters=(
        Parameter('null_offset', 'm', -2e-3, 2e-3, 'null bias of the valve as control error', 0.0),
    ),
    group='offset',
    signature='constant offset; with k > 0 and leakage slightly smaller than without',
    source='Merritt 1967',
    meaning='the valve is not closed at zero',
    remedy='adjust the null of the servo-valve',
    starts=lambda s: ((0.02 * s.stroke,), (-0.02 * s.stroke,)),
    stage=Stage(adds={'error': njit(lambda p: p.null_offset)}),
)
