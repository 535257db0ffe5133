"""Coordinates in which one record's posterior is nearly a normal distribution in a box.

Under one specimen stiffness k, Eq. (2a) divided by n0 is the inverse of the response,

    u/x = (d2/n0) s^2 + (d1/n0) s + d0/n0.

The record's error is, to first order, linear in these three coefficients, and so are their
posterior's ridges straight. In the physical parameters, and in d1/d2 and d0/d2, the same ridge is
bent, a thousand times longer than wide: a sampler creeps. The sampling coordinates are

    ln d1/n0 [s], ln d2/n0 [s^2], alpha_3 k/(k + alpha_2) [1/s],

which fix the three coefficients, and alpha_2, of which one record says nothing more, as the share
of the way from its least to its largest value inside the prior's box given the other three (as
a logit, so that a prior-dominated posterior has no wall). Parameters of effects are logits between
their bounds. The prior stays uniform in the physical parameters: given the other coordinates,
(k + alpha_2)^3 is uniform. At k = 0 alpha_3 does not act and stays as it is, and alpha_2^2 is
uniform.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.inference.chains import Chains
from actuator_glue.inference.compiled import Compiled, compiled
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.model import ridge
from actuator_glue.online.settings import ModelChoice
from actuator_glue.records import Array

# ln d1/n0 (lag of the loop, 1 us .. 1000 s) and ln d2/n0 (natural frequency 1000 .. 0.05 Hz): no
# servo-hydraulic actuator is outside; logarithms need limits, since the prior reaches zero.
_LAG = (float(np.log(1e-6)), float(np.log(1e3)))
_INERTIA = tuple(float(-2.0 * np.log(2.0 * np.pi * f)) for f in (1000.0, 0.05))


class Coordinates:
    """Maps physical parameters (m, p) to sampling coordinates and back, for one stiffness.

    Args:
        model: gives the prior's box.
        stiffness: specimen stiffness k [N/m].
    """

    def __init__(self, model: ModelChoice, stiffness: float) -> None:
        self._low, self._high = model.bounds
        self._k = stiffness
        self.lower = np.full(len(self._low), -ridge.EDGE)
        self.upper = np.full(len(self._low), ridge.EDGE)
        self.lower[0], self.upper[0] = _LAG
        self.lower[1], self.upper[1] = _INERTIA
        self.lower[3], self.upper[3] = self._low[3], self._high[3]
        if stiffness > 0.0:
            self.lower[3] *= stiffness / (stiffness + self._high[2])
            self.upper[3] *= stiffness / (stiffness + self._low[2])
        # The sampler takes logarithms above a lower bound of 0, which bends what is straight. A
        # bound just below is none; the prior's box is checked all the same.
        if self.lower[3] == 0.0:
            self.lower[3] = -1e-6 * self.upper[3]

    def physical(self, phi: Array) -> Array:
        """Return physical parameters of coordinates, (..., p)."""
        flat = np.ascontiguousarray(phi).reshape(-1, len(self._low))
        theta = np.empty_like(flat)
        ridge.physical_all(flat, self._k, self._low, self._high, theta, np.empty(len(flat)))
        return theta.reshape(phi.shape)

    def coordinates(self, theta: Array) -> Array:
        """Return coordinates of physical parameters, (..., p), moved inside their bounds."""
        flat = np.ascontiguousarray(theta, dtype=np.float64).reshape(-1, len(self._low))
        phi = np.empty_like(flat)
        ridge.coordinates_all(flat, self._k, self._low, self._high, phi)
        return np.clip(phi, self.lower, self.upper).reshape(theta.shape)

    def log_jacobian(self, phi: Array) -> Array:
        """Return the log prior density in the coordinates, (...,), less a constant."""
        flat = np.ascontiguousarray(phi).reshape(-1, len(self._low))
        values = np.empty(len(flat))
        ridge.physical_all(flat, self._k, self._low, self._high, np.empty_like(flat), values)
        return values.reshape(phi.shape[:-1])

    def density(self, log_likelihood: LogDensity) -> LogDensity:
        """Return the log posterior density of coordinates (m, p) -> (m,)."""
        return _Density(log_likelihood, self._k, self._low, self._high)

    def chains(self, sampled: Chains) -> Chains:
        """Return chains of coordinates as chains of physical parameters with log likelihoods."""
        return replace(
            sampled,
            draws=self.physical(sampled.draws),
            log_density=sampled.log_density - self.log_jacobian(sampled.draws),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Density:
    """Log likelihood of the physical parameters plus the log Jacobian."""

    log_likelihood: LogDensity
    stiffness: float
    low: Array
    high: Array

    def __call__(self, phi: Array) -> Array:
        """Return the log posterior density (m,) of coordinates (m, p)."""
        theta, values = np.empty_like(phi), np.empty(len(phi))
        if ridge.physical_all(phi, self.stiffness, self.low, self.high, theta, values):
            values += self.log_likelihood(theta)
            return values
        # Outside the prior's box the likelihood may be slow, and is not needed.
        inside = np.isfinite(values)
        if inside.any():
            values[inside] += self.log_likelihood(np.ascontiguousarray(theta[inside]))
        return values

    def compiled(self) -> Compiled | None:
        """Return the same as plain arrays, where the likelihood has such a form."""
        found = compiled(self.log_likelihood)
        if found is None:
            return None
        return found._replace(mapped=True, stiffness=self.stiffness, low=self.low, high=self.high)
