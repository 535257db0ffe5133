"""Flow limited to what the valve is rated for."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

NO_LIMIT = 2.0  # m/s; at or above it nothing is limited

EFFECT = Effect(
    name='flow-saturation',
    place='flow',
    equation='Q = clip(q, -alpha_2 v_max, alpha_2 v_max)',
    parameters=(
        Parameter(
            'saturation_velocity',
            'm/s',
            1e-3,
            NO_LIMIT,
            'free piston velocity at rated flow',
            NO_LIMIT,
            'flow',
        ),
    ),
    group='saturation',
    signature='odd harmonics above an onset in velocity',
    source='Merritt 1967; Jelali & Kroll 2003',
    starts=lambda s: ((0.95 * s.velocity,), (0.75 * s.velocity,), (0.5 * s.velocity,)),
    switches=(rows.ON_FLOW,),
)
