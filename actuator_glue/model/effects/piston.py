"""Effects at the piston: dry friction and play between piston and transducer."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

COULOMB = Effect(
    name='coulomb-friction',
    place='piston',
    equation='f = f_specimen + F_c sign(v), |.| <= F_c while v = 0',
    parameters=(Parameter('coulomb_force', 'N', 0.0, 2e4, 'dry friction of the seals', 0.0),),
    group='friction',
    signature='odd harmonics with the sign of the velocity; relative size falls as 1/A',
    source='Armstrong-Helouvry et al. 1994; return mapping: Simo & Hughes 1998',
    starts=lambda s: tuple((share * s.oil * s.stroke,) for share in (0.005, 0.02, 0.08)),
)

STRIBECK = Effect(
    name='stribeck-friction',
    place='piston',
    equation="f = f_specimen + F sign(v), T_m F' + F = F_c (1 + (r - 1) exp(-(v/v_s)^2)), "
    'T_m = max(2 ms, 1.72 (r - 1) F_c/((k + alpha_2) v_s))',
    parameters=(
        Parameter('sliding_force', 'N', 0.0, 2e4, 'dry friction when sliding fast', 0.0),
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
)

BACKLASH = Effect(
    name='backlash',
    place='piston',
    equation='y = play(x, b): y moves with x only while |x - y| = b',
    parameters=(
        Parameter('backlash', 'm', 0.0, 1e-3, 'play before the transducer, half width', 0.0),
    ),
    group='lost-motion',
    signature='rectangular loop against displacement, flat after reversals; size falls as 1/A',
    source='Tao & Kokotovic 1996 (play operator)',
    starts=lambda s: ((0.005 * s.stroke,), (0.02 * s.stroke,), (0.06 * s.stroke,)),
    switches=(rows.ON_TRANSDUCER,),
)

EFFECTS = (COULOMB, STRIBECK, BACKLASH)
