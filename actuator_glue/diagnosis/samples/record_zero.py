"""A record's own zero: the offset and the drift of its transducer, which no other record tells.

A zero is set, or rests, differently from test to test and wanders with temperature. What that does
to a simulation of a held-out record is a straight line in time, no effect that the model lacks.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Array


def lines(data: Data) -> Iterator[tuple[slice, Array]]:
    """Yield where each record's counted samples lie, and its offset and drift (2, n).

    Both have a mean square of one, and are at right angles.
    """
    for part, time in zip(data.parts, data.times, strict=True):
        drift = time - time.mean()
        size = float(np.sqrt(np.mean(drift**2)))
        yield part, np.stack([np.ones(len(time)), drift / max(size, 1e-300)])


def without(data: Data, error: Array) -> Array:
    """Return an error (N,) without the straight line of each record [m]."""
    out = np.array(error)
    for part, line in lines(data):
        out[part] -= (line @ out[part]) @ line / line.shape[1]
    return out
