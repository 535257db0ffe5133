"""The effect catalogue: what Eq. (2) may lack, one file per effect, all in one compiled step."""

from __future__ import annotations

from actuator_glue.model.effects import catalogue
from actuator_glue.model.effects.effect import Effect, Scale, scale
from actuator_glue.model.effects.registry import Registry

# Every effect by its name on the command line; registered ones follow.
CATALOGUE = Registry(catalogue.ENTRIES)

__all__ = ['CATALOGUE', 'Effect', 'Scale', 'scale']
