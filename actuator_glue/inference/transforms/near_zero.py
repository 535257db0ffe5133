"""A coordinate that is positive by its prior and may be next to nothing."""

from __future__ import annotations

import numpy as np
from scipy.special import wrightomega

from actuator_glue.records import Array


class NearZero:
    """Transform of coordinates y (m, p) to z: one of them, s, becomes s / scale + ln(s / scale).

    A prior uniform in the logarithm of s piles up at values so small that the records cannot tell
    them from 0. There z is the logarithm; at larger values z is s itself, in which a ridge is
    straight.

    Args:
        column: of s.
        scale: least value that the records can tell from 0.
        dimension: p.
    """

    def __init__(self, column: int, scale: float, dimension: int) -> None:
        self._column, self._scale = column, scale
        self.lower, self.upper = np.full(dimension, -np.inf), np.full(dimension, np.inf)

    def forward(self, y: Array) -> Array:
        """Return coordinates z (m, p) of coordinates y (m, p)."""
        z = np.array(y)
        share = np.maximum(y[:, self._column] / self._scale, 1e-300)
        z[:, self._column] = share + np.log(share)
        return z

    def inverse(self, z: Array) -> tuple[Array, Array]:
        """Return coordinates y (m, p) of coordinates z (m, p), and ln |dy/dz| (m,)."""
        y = np.array(z)
        share = np.maximum(wrightomega(z[:, self._column]), 1e-300)
        y[:, self._column] = self._scale * share
        return y, np.log(share / (1.0 + share))
