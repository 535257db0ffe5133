"""Effects between spool position and flow into the cylinder: Q = F(q, f, t)."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.coefficients import NO_LIMIT
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

SATURATION = Effect(
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
        ),
    ),
    group='saturation',
    signature='odd harmonics above an onset in velocity',
    source='Merritt 1967; Jelali & Kroll 2003',
    starts=lambda s: ((0.95 * s.velocity,), (0.75 * s.velocity,), (0.5 * s.velocity,)),
    switches=(rows.ON_FLOW,),
)

PRESSURE = Effect(
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

ASYMMETRY = Effect(
    name='flow-asymmetry',
    place='flow',
    equation='Q = q (1 + a sign(q))',
    parameters=(
        Parameter(
            'asymmetry', '1', -0.6, 0.6, 'flow gain out against in, half the difference', 0.0
        ),
    ),
    group='asymmetry',
    signature='even harmonics and a mean that follows the velocity',
    source='Jelali & Kroll 2003 (single-rod cylinder)',
    starts=lambda s: ((0.03,), (-0.03,), (0.15,), (-0.15,)),
    switches=(rows.ON_FLOW,),
)

DROOP = Effect(
    name='supply-droop',
    place='flow',
    equation="Q = q sqrt(max(1 - d w, 0)), T w' + w = |q|/alpha_2",
    parameters=(
        Parameter('droop', 's/m', 0.0, 20.0, 'supply pressure lost per mean velocity', 0.0),
        Parameter('droop_time', 's', 0.02, 20.0, 'time constant of accumulator and pump', 0.5),
    ),
    group='flow-time',
    signature='gain follows the envelope of the flow',
    source='Merritt 1967 (constant-pressure supplies with accumulator)',
    starts=lambda s: tuple(
        (share / s.velocity, time) for share in (0.05, 0.25) for time in (0.2, 1.0, 5.0)
    ),
    switches=(rows.ON_FLOW, rows.ON_DROOP),
)

DRIFT = Effect(
    name='gain-drift',
    place='flow',
    equation='Q = q max(1 + r t, 0), t from the start of the record',
    parameters=(
        Parameter(
            'gain_drift', '1/s', -0.05, 0.05, 'relative change of flow gain with oil heating', 0.0
        ),
    ),
    group='flow-time',
    signature='parameters trend with time, not with amplitude',
    source='Jelali & Kroll 2003 (viscosity and bulk modulus against temperature)',
    starts=lambda s: ((0.05 / s.duration,), (-0.05 / s.duration,), (0.2 / s.duration,)),
    switches=(rows.ON_FLOW,),
)

EFFECTS = (SATURATION, PRESSURE, ASYMMETRY, DROOP, DRIFT)
