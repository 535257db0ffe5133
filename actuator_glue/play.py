"""The play operator: what a motion drags along behind a gap."""

from __future__ import annotations

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.records import Array


@njit(nogil=True)
def play(signal: Array, half_width: float, start: float) -> Array:
    """Follow a signal only where it is at the edge of a gap (Prandtl 1928).

    Args:
        signal: shape (n,), of any unit.
        half_width: of the gap, in the signal's unit.
        start: where the operator is before the first sample.

    Returns:
        Play of the signal, shape (n,).
    """
    out, at = np.empty(len(signal)), start
    for i in range(len(signal)):
        at = min(max(at, signal[i] - half_width), signal[i] + half_width)
        out[i] = at
    return out
