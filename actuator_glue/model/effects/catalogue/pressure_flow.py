"""Orifice equation: flow that depends on the load."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
    name='pressure-flow',
    place='flow',
    equation='Q = q sqrt(max(1 - sign(q) f/F_s, 0))',
    parameters=(
        Parameter(
            'inverse_stall_force', '1/N', 0.0, 1e-2, '1/F_s: one over supply pressure x area', 0.0
        ),
    ),
    group='pressure-flow',
    signature='odd harmonics that grow with the load; none without a specimen',
    source='Merritt 1967 (orifice equation, load pressure p_L = f/A)',
    starts=lambda s: tuple(
        (share / max(s.stiffness * s.stroke, 0.2 * s.oil * s.stroke),) for share in (0.1, 0.4)
    ),
    switches=(rows.ON_FLOW, rows.ON_PRESSURE),
)
