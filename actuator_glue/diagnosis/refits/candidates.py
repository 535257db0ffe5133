"""Which effects the diagnosis tries."""

from __future__ import annotations

from collections.abc import Container, Mapping

from actuator_glue.model.effects import CATALOGUE, Effect
from actuator_glue.model.structure import Structure

# Closes the controller's loop on the recorded transducer: found only with a fault of it.
FEEDBACK = 'sensor-feedback'
# Not bias or drift: of these, inside the loop, the record shows only the transition.
FAULTS = ('backlash', 'sensor-curve', 'sensor-lag')


def mean_effects(reserved: bool = False) -> tuple[str, ...]:
    """Return the effects with a mean response; diagnosis/measured finds the others."""
    names = CATALOGUE.searched(reserved)
    return tuple(n for n in names if CATALOGUE[n].variance is None and n != 'hum')


def structure_of(entries: Mapping[str, Effect], names: Container[str]) -> Structure:
    """Return Eq. (2) with some effects, in the order in which `entries` holds them."""
    return Structure(effect for name, effect in entries.items() if name in names)
