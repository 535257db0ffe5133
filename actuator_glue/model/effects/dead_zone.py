"""Dead zone: the part of a value beyond a limit on either side."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit


@njit
def beyond(value: Any, limit: Any) -> Any:
    """Part of a value beyond +-limit; a value that is not a number stays so."""
    return value - min(max(value, -limit), limit)
