"""Transducer that is not linear."""

from __future__ import annotations

from dataclasses import replace

from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter

EFFECT = replace(
    term(
        'sensor-curve',
        'sensor: y = y + sensor_even*y**2 + sensor_odd*y**3',
        (
            # Half of the reading at strokes of 1 mm.
            Parameter('sensor_even', '1/m', -500.0, 500.0, 'even part', 0.0),
            Parameter('sensor_odd', '1/m^2', -5e5, 5e5, 'odd part', 0.0),
        ),
        group='sensor-curve',
        signature='harmonics that do not depend on frequency; relative size grows with A and A^2',
        source='IEEE Std 1057-2017 (integral nonlinearity)',
        check=False,
    ),
    meaning='the transducer reads more in one part of its stroke than in another',
    remedy='calibrate the transducer over its stroke; use its straight part',
)
