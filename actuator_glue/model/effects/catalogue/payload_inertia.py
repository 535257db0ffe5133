"""Mass that moves with the piston."""

from __future__ import annotations

import math

from actuator_glue.jit import njit
from actuator_glue.model.effects import linear_step
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.effects.stage import Stage
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='payload-inertia',
    place='specimen',
    equation="f = k x + m (v' + d v)",
    parameters=(
        Parameter('mass', 'kg', 0.0, 2e4, 'moving mass', 0.0, 'share'),
        Parameter(
            'mass_damping', '1/s', 0.0, 500.0, 'damping over moving mass', 20.0, 'mass-damping'
        ),
    ),
    group='inertia',
    signature='linear; resonance of the mass on the oil column',
    source='Dyke et al. 1995; Merritt 1967',
    meaning='a mass moves along with the piston',
    remedy='weigh what moves; declare it with --effect, and keep resonance out of the test',
    starts=lambda s: tuple(
        (s.oil / (2.0 * math.pi * hz) ** 2, 2.0 * ratio * 2.0 * math.pi * hz)
        for hz in (80.0, 40.0, 20.0)
        for ratio in (0.1, 0.4)
    ),
    exact=linear_step.MASS,
    stage=Stage(
        adds={'damping': njit(lambda p: p.mass * p.mass_damping), 'mass': njit(lambda p: p.mass)}
    ),
)
