"""Specimen whose stiffness changes with displacement."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

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
    starts=lambda s: tuple((share / s.stroke**2,) for share in (0.1, -0.1, 0.5)),
    switches=(rows.ON_CURVED,),
)
