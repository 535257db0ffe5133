"""Supply pressure that falls with the mean flow."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
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
