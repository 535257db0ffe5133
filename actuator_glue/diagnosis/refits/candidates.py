"""Which effects the diagnosis tries."""

from __future__ import annotations

from actuator_glue.model.effects import CATALOGUE

# Closes the controller's loop on the recorded transducer: found only with a fault of it.
FEEDBACK = 'sensor-feedback'
# Not bias or drift: of these, inside the loop, the record shows only the transition.
FAULTS = ('backlash', 'sensor-curve', 'sensor-lag')


def mean_effects(reserved: bool = False) -> tuple[str, ...]:
    """Return the effects with a mean response; diagnosis/measured finds the others."""
    names = CATALOGUE.searched(reserved)
    return tuple(n for n in names if CATALOGUE[n].variance is None and n != 'hum')
