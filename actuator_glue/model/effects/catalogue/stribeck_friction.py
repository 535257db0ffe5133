"""Dry friction that falls with velocity."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='stribeck-friction',
    place='piston',
    equation="f = f_specimen + F sign(v), T_m F' + F = F_c (1 + (r - 1) exp(-(v/v_s)^2)), "
    'T_m = max(2 ms, 1.72 (r - 1) F_c/((k + alpha_2) v_s))',
    parameters=(
        Parameter(
            'sliding_force', 'N', 0.0, 2e4, 'dry friction when sliding fast', 0.0, 'sliding-force'
        ),
        Parameter('breakaway_ratio', '1', 1.0, 4.0, 'break-away over sliding friction', 1.5),
        Parameter('stribeck_velocity', 'm/s', 5e-4, 0.1, 'Stribeck velocity', 0.01),
    ),
    group='friction',
    signature='as Coulomb friction, with stick-slip at reversals',
    source='Armstrong-Helouvry et al. 1994 (Stribeck curve, frictional memory)',
    starts=lambda s: tuple(
        (share * s.oil * s.stroke, ratio, speed)
        for share in (0.005, 0.02, 0.08)
        for ratio, speed in ((1.5, 0.005), (2.0, 0.03))
    ),
    switches=(rows.ON_STRIBECK,),
    holds=('coulomb-friction', 'breakaway_ratio', 1.0),
)
