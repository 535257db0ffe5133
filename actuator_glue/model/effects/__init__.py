"""The effect catalogue: what Eq. (2) may lack, one entry per effect, all in one compiled step."""

from __future__ import annotations

from actuator_glue.model.effects import command, flow, piston, sensor, specimen, valve
from actuator_glue.model.effects.effect import Effect, Place, Scale, scale
from actuator_glue.model.effects.registry import Registry

_ENTRIES = (
    *command.EFFECTS,
    *valve.EFFECTS,
    *flow.EFFECTS,
    *piston.EFFECTS,
    *specimen.EFFECTS,
    *sensor.EFFECTS,
)

# Every effect by its name on the command line, in the order command -> sensor; registered ones
# follow.
CATALOGUE = Registry(_ENTRIES)

__all__ = ['CATALOGUE', 'Effect', 'Place', 'Scale', 'scale']
