"""How well a diagnosis tells the time that is left."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

_EVERY: Final = 0.5  # s between two looks at what is told
FACTOR: Final = 2.0
NEARLY: Final = 1.0  # s: nobody minds


def told_in_time(told: list[tuple[float, float]], seconds: float) -> float:
    """Return the share of looks at which the time left is told within `FACTOR`, or `NEARLY`.

    As by a bar: the time so far, times what is not done over what is done.

    Args:
        told: (seconds since the start, share that is done), ascending in time.
        seconds: at the end.
    """
    looks: NDArray[np.float64] = np.arange(_EVERY, max(seconds, 2.0 * _EVERY), _EVERY)
    times, shares = np.array(told).T
    last = np.searchsorted(times, looks, side='right') - 1
    done = np.where(last < 0, 0.0, shares[np.maximum(last, 0)])
    with np.errstate(divide='ignore'):
        said = looks * (1.0 - done) / done
    left = seconds - looks
    near = np.abs(said - left) <= NEARLY
    return float(np.mean(near | ((said <= FACTOR * left) & (said >= left / FACTOR))))
