"""Definitions of the user's own effects, which travel with every result that needs them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.effects.terms.definition import entries, mapping


def definitions(names: Iterable[str]) -> dict[str, Any]:
    """Return `{'definitions': ...}` of those effects that are the user's own, else nothing.

    What is saved with it can be read where the file of effects is not at hand.
    """
    wanted = set(names)
    own = mapping(e for e in CATALOGUE.registered() if e.name in wanted)
    return {'definitions': own} if own else {}


def register(content: Any, source: str) -> None:
    """Register effects from their definitions, in place of others of the same names.

    Raises:
        InputError: an effect cannot be used.
    """
    for effect in entries(content, source):
        CATALOGUE.register(effect, replace=True)
