"""Effects in the specimen: f = k x replaced by a force with more in it."""

from __future__ import annotations

import math

from actuator_glue.model.effects import lti, rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

DAMPING = Effect(
    name='viscous-damping',
    place='specimen',
    equation='f = k x + c v',
    parameters=(Parameter('damping', 'N s/m', 0.0, 2e5, 'viscous damping', 0.0),),
    group='gain',
    signature='linear; absorbed by the base parameters unless two stiffnesses are known',
    source='Dyke et al. 1995',
    starts=lambda s: tuple(
        (share * s.oil * s.stroke / s.velocity,) for share in (0.01, 0.05, 0.3)
    ),
    exact=lti.VELOCITY,
)

INERTIA = Effect(
    name='payload-inertia',
    place='specimen',
    equation="f = k x + m (v' + d v)",
    parameters=(
        Parameter('mass', 'kg', 0.0, 2e4, 'moving mass', 0.0),
        Parameter('mass_damping', '1/s', 0.0, 500.0, 'damping over moving mass', 20.0),
    ),
    group='inertia',
    signature='linear; resonance of the mass on the oil column',
    source='Dyke et al. 1995; Merritt 1967',
    starts=lambda s: tuple(
        (s.oil / (2.0 * math.pi * hz) ** 2, 2.0 * ratio * 2.0 * math.pi * hz)
        for hz in (80.0, 40.0, 20.0)
        for ratio in (0.1, 0.4)
    ),
    exact=lti.MASS,
)

GAP = Effect(
    name='specimen-gap',
    place='specimen',
    equation='f = k D(x, g), D(x, g) = sign(x) max(|x| - g, 0)',
    parameters=(Parameter('gap', 'm', 0.0, 1e-2, 'gap at the specimen, half width', 0.0),),
    group='gap',
    signature='odd; stiffness missing around zero displacement',
    source='Kerschen et al. 2006 (clearance)',
    starts=lambda s: ((0.02 * s.stroke,), (0.1 * s.stroke,), (0.3 * s.stroke,)),
    switches=(rows.ON_GAP,),
)

HARDENING = Effect(
    name='specimen-hardening',
    place='specimen',
    equation='f = k x (1 + kappa x^2); past the peak of a softening curve the secant 2/3 stays',
    parameters=(
        Parameter('hardening', '1/m^2', -3e5, 3e6, 'cubic stiffness over stiffness', 0.0),
    ),
    group='hardening',
    signature='odd harmonics; relative size grows as A^2',
    source='Kerschen et al. 2006 (Duffing)',
    starts=lambda s: tuple((share / s.stroke**2,) for share in (0.1, -0.1, 0.5)),
    switches=(rows.ON_CURVED,),
)

YIELD = Effect(
    name='specimen-yield',
    place='specimen',
    equation='f = k (a x + (1 - a) z), dz/dx = 1 - |z/x_y|^n while loading, 1 while unloading, '
    'n = 2^sharpness (powers between 1, 2, 4, 8, 16 interpolated)',
    parameters=(
        Parameter('post_yield_ratio', '1', 0.0, 1.0, 'stiffness after over before yield', 1.0),
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

EFFECTS = (DAMPING, INERTIA, GAP, HARDENING, YIELD)
