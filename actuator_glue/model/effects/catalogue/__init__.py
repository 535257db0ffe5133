"""One file an effect: its EFFECT says everything that others need to know of it.

A file in this folder is enough for an effect to be in the catalogue.
"""

from __future__ import annotations

import importlib
import pkgutil

from actuator_glue.model.effects.effect import Effect

# The order of their parameters in models of several effects; what is newer comes after them, by
# name, so that results keep their order.
_FIRST = [
    'delay',
    'gain',
    'valve_lag',
    'valve_deadband',
    'valve_null',
    'flow_saturation',
    'pressure_flow',
    'flow_asymmetry',
    'supply_droop',
    'gain_drift',
    'coulomb_friction',
    'stribeck_friction',
    'backlash',
    'viscous_damping',
    'payload_inertia',
    'specimen_gap',
    'specimen_hardening',
    'specimen_yield',
    'sensor_lag',
    'bias',
    'drift',
    'hum',
    'quantisation',
    'clock_skew',
    'timing_jitter',
]


def _found() -> tuple[Effect, ...]:
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    order = (*_FIRST, *(name for name in names if name not in _FIRST))
    return tuple(importlib.import_module(f'{__name__}.{name}').EFFECT for name in order)


# The effect of every file here. All are imported together and in this order, whichever is wanted:
# what the compiled step (njit) has of their rows is the same in every process.
ENTRIES = _found()
