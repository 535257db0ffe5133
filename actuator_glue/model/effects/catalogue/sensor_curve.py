"""Transducer that is not linear."""

from __future__ import annotations

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

EFFECT = term(
    'sensor-curve',
    'sensor: y = y + sensor_even*y**2 + sensor_odd*y**3',
    (
        Parameter('sensor_even', '1/m', -50.0, 50.0, 'even part', 0.0),
        Parameter('sensor_odd', '1/m^2', -4e4, 4e4, 'odd part', 0.0),
    ),
    group='sensor-curve',
    signature='harmonics that do not depend on frequency; relative size grows with A and A^2',
    source='IEEE Std 1057-2017 (integral nonlinearity)',
    check=False,
)
