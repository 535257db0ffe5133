"""Which effects are asked for."""

from __future__ import annotations

from actuator_glue.model.effects import CATALOGUE

# Closes the controller's loop on the recorded transducer: found beside a fault of it alone.
FEEDBACK = 'sensor-feedback'
# A bias or a drift inside of the loop leaves nothing in the record but the way there.
FAULTS = ('backlash', 'sensor-curve', 'sensor-lag')


def mean_effects(reserved: bool = False) -> tuple[str, ...]:
    """Return the effects with a mean response; measurement.py and hum.py find the others."""
    names = CATALOGUE.searched(reserved)
    return tuple(n for n in names if CATALOGUE[n].variance is None and n != 'hum')
