"""Dead zone: what of a value lies beyond a limit on either side."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit


@njit
def beyond(value: Any, limit: Any) -> Any:
    """What of a value lies beyond +-limit; a value that is not a number stays so."""
    return value - min(max(value, -limit), limit)
