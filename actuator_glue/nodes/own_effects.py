"""The parameter effects_file: effects of the user's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actuator_glue.effects import load_effects
from actuator_glue.nodes.parameters import Spec

SPEC = Spec('effects_file', '', 'effects of your own, as docs/effects.md says', read_only=True)


def load(values: Mapping[str, Any]) -> None:
    """Register the effects of the file, if one is given.

    Raises:
        InputError: the file or an effect cannot be used.
    """
    if values[SPEC.name]:
        load_effects(values[SPEC.name])
