"""Standard deviations and principal axes of a normal approximation (Laplace's)."""

from __future__ import annotations

import numpy as np

from actuator_glue.records import Array

# Limits of the coordinates in standard deviations.
_REACH = 100.0


class Laplace:
    """Transform of coordinates y (m, p) to z, in which the approximation is standard normal.

    Args:
        centre: its mean, (p,).
        covariance: its covariance, (p, p); directions without any variance stay where they are.
        widest: standard deviations (p,) beyond which nothing is known, and those of what the
            covariance says nothing about.
    """

    def __init__(self, centre: Array, covariance: Array, widest: Array) -> None:
        # What the data say nothing about has a variance of 0 or of many decades: left in the
        # covariance, it takes all digits from the directions that they do fix.
        sd = np.sqrt(np.diag(covariance))
        told = sd > 0.0
        safe = np.where(told, sd, 1.0)
        correlation = covariance / np.outer(safe, safe)
        correlation[np.diag_indices(len(sd))] = 1.0
        values, vectors = np.linalg.eigh(correlation)
        spread = np.minimum(np.where(told, sd, widest), widest)
        self._centre = centre
        self.root = spread[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        self.lower, self.upper = np.full(len(sd), -_REACH), np.full(len(sd), _REACH)

    def forward(self, x: Array) -> Array:
        """Return the coordinates z (m, p) of coordinates y (m, p)."""
        z = (x - self._centre) @ np.linalg.pinv(self.root).T
        return np.clip(z, self.lower, self.upper)

    def inverse(self, z: Array) -> tuple[Array, Array]:
        """Return y (m, p) of coordinates z (m, p), and zeros (m,): |dy/dz| is constant."""
        return self._centre + z @ self.root.T, np.zeros(len(z))
