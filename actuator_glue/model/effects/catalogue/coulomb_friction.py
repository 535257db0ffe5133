"""Dry friction of the seals."""

from __future__ import annotations

from actuator_glue.jit import njit
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='coulomb-friction',
    place='piston',
    equation='f = f_specimen + F_c sign(v), |.| <= F_c while v = 0',
    parameters=(
        Parameter('coulomb_force', 'N', 0.0, 2e4, 'dry friction of the seals', 0.0, 'share'),
    ),
    group='friction',
    signature='odd harmonics with the sign of the velocity; relative size falls as 1/A',
    source='Armstrong-Helouvry et al. 1994; return mapping: Simo & Hughes 1998',
    meaning='seals, guides or swivels rub, whatever the speed',
    remedy='check seals, guide bushings, alignment and side load',
    starts=lambda s: tuple((share * s.oil * s.stroke,) for share in (0.005, 0.02, 0.08)),
    stage=Stage(adds={'dry': njit(lambda p: p.coulomb_force)}),
)
