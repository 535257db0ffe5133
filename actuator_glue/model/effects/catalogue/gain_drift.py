"""Flow gain that drifts as the oil warms."""

from __future__ import annotations

from actuator_glue.model.effects import rows
from actuator_glue.model.effects.effect import Effect
from actuator_glue.model.parameters import Parameter

EFFECT = Effect(
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
    record_time=True,
)
