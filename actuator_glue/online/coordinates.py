"""Coordinates in which one record's posterior is nearly a normal distribution in a box.

Under one specimen stiffness k, Eq. (2a) divided by n0 is the inverse of the response,

    u/x = (d2/n0) s^2 + (d1/n0) s + d0/n0.

The record's error is, to first order, linear in these three coefficients, and so are their
posterior's ridges straight. In the physical parameters, and in d1/d2 and d0/d2, the same ridge is
bent, a thousand times longer than wide: a sampler creeps. The sampling coordinates are

    ln d1/n0 [s], ln d2/n0 [s^2], alpha_3 k/(k + alpha_2) [1/s],

which fix the three coefficients, and alpha_2, of which one record says nothing more, as the share
of the way from its least to its largest value inside the prior's box given the other three (as
a normal score, so that a prior-dominated posterior has no wall and is normal). The prior stays
uniform in the physical parameters: given the other coordinates, (k + alpha_2)^3 is uniform. At
k = 0 alpha_3 does not act: it is the normal score of its place in the box; alpha_2^2 is uniform.

With effects: `model.ridge_effects` says what their coordinates are, and what remains bent is
straightened by what an earlier window has shown (`shear`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.inference import dream
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.compiled import Compiled, compiled
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.model import ridge, ridge_effects
from actuator_glue.online.settings import ModelChoice
from actuator_glue.online.shear import LIMIT, Shear
from actuator_glue.records import Array

# ln d1/n0 (lag of the loop, 1 us .. 1000 s) and ln d2/n0 (natural frequency 1000 .. 0.05 Hz): no
# servo-hydraulic actuator is outside; logarithms need limits, since the prior reaches zero.
_LAG = (float(np.log(1e-6)), float(np.log(1e3)))
_INERTIA = tuple(float(-2.0 * np.log(2.0 * np.pi * f)) for f in (1000.0, 0.05))

# Points per parameter that can show a bend.
_ENOUGH = 20
# Points of the prior that a cold start is fitted to.
_PRIOR = 2000


class Coordinates:
    """Maps physical parameters (m, p) to sampling coordinates and back, for one stiffness.

    Args:
        model: gives the prior's box.
        stiffness: specimen stiffness k [N/m].
        middle: time of the window's middle since the test began [s].
        points: physical parameters (m, p) of an earlier posterior near this one, if there is one.
    """

    def __init__(
        self,
        model: ModelChoice,
        stiffness: float,
        points: Array | None = None,
        middle: float = 0.0,
    ) -> None:
        self._low, self._high = model.bounds
        self._k = stiffness
        self._middle = middle
        self._at = ridge_effects.columns(model.names)
        self.lower, self.upper = ridge_effects.bounds(self._at, stiffness, self._low, self._high)
        self.lower[:4], self.upper[:4] = -ridge.EDGE, ridge.EDGE
        self.lower[0], self.upper[0] = _LAG
        self.lower[1], self.upper[1] = _INERTIA
        if stiffness > 0.0:
            self.lower[3] = self._low[3] * stiffness / (stiffness + self._high[2])
            self.upper[3] = self._high[3] * stiffness / (stiffness + self._low[2])
        # The sampler takes logarithms above a lower bound of 0, which bends what is straight. A
        # bound just below is none; the prior's box is checked all the same.
        self.lower = np.where(self.lower == 0.0, -1e-6 * self.upper, self.lower)
        self._shear: Shear | None = None
        p = len(self._low)
        if model.effects and points is not None and len(points) >= _ENOUGH * p:
            self._shear = Shear(self.coordinates(points))
            self._box = self.lower, self.upper
            self.lower, self.upper = np.full(p, -LIMIT), np.full(p, LIMIT)

    def _map(self, v: Array) -> tuple[Array, Array]:
        """Return physical parameters (m, p) and log Jacobians (m,) of coordinates (..., p)."""
        z = np.ascontiguousarray(v, dtype=np.float64).reshape(-1, len(self._low))
        if self._shear is not None:
            z = self._shear.bent(z)
        theta, log_jacobian = np.empty_like(z), np.empty(len(z))
        if len(self._low) == 4:
            ridge.physical_all(z, self._k, self._low, self._high, theta, log_jacobian)
        else:
            ridge_effects.physical_all(
                z, self._k, self._low, self._high, self._at, self._middle, theta, log_jacobian
            )
        if self._shear is not None:
            log_jacobian[~((z >= self._box[0]) & (z <= self._box[1])).all(axis=1)] = -np.inf
        return theta, log_jacobian

    def physical(self, phi: Array) -> Array:
        """Return physical parameters of coordinates, (..., p)."""
        return self._map(phi)[0].reshape(phi.shape)

    def coordinates(self, theta: Array) -> Array:
        """Return coordinates of physical parameters, (..., p), moved inside their bounds."""
        flat = np.ascontiguousarray(theta, dtype=np.float64).reshape(-1, len(self._low))
        z = np.empty_like(flat)
        ridge_effects.coordinates_all(
            flat, self._k, self._low, self._high, self._at, self._middle, z
        )
        if self._shear is not None:
            z = self._shear.straight(np.clip(z, *self._box))
        return np.clip(z, self.lower, self.upper).reshape(theta.shape)

    def cold(
        self, rng: np.random.Generator, settings: dream.Settings
    ) -> tuple[dream.Settings, Array]:
        """Return what starts the sampler from the prior: settings, and an archive of points.

        The sampler's own start is uniform in the coordinates, where corners of the prior's box
        loom large: one start in four was lost to a hill 50 nats below.
        """
        points = rng.uniform(self._low, self._high, (_PRIOR, len(self._low)))
        # From an archive the sampler takes a quarter of its population.
        population = 4 * settings.points(len(self._low))
        return replace(settings, population=population), self.coordinates(points)

    def log_jacobian(self, phi: Array) -> Array:
        """Return the log prior density in the coordinates, (...,), less a constant."""
        return self._map(phi)[1].reshape(phi.shape[:-1])

    def density(self, log_likelihood: LogDensity) -> LogDensity:
        """Return the log posterior density of coordinates (m, p) -> (m,)."""
        return _Density(log_likelihood, self, self._k, self._low, self._high)

    def chains(self, sampled: Chains) -> Chains:
        """Return chains of coordinates as chains of physical parameters with log likelihoods."""
        draws, log_jacobian = self._map(sampled.draws)
        return replace(
            sampled,
            draws=draws.reshape(sampled.draws.shape),
            log_density=sampled.log_density - log_jacobian.reshape(sampled.log_density.shape),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Density:
    """Log likelihood of the physical parameters plus the log Jacobian."""

    log_likelihood: LogDensity
    coordinates: Coordinates
    stiffness: float
    low: Array
    high: Array

    def __call__(self, phi: Array) -> Array:
        """Return the log posterior density (m,) of coordinates (m, p)."""
        theta, values = self.coordinates._map(phi)
        # Outside the prior's box the likelihood may be slow, and is not needed.
        inside = np.isfinite(values)
        if inside.all():
            values += self.log_likelihood(theta)
        elif inside.any():
            values[inside] += self.log_likelihood(np.ascontiguousarray(theta[inside]))
        return values

    def compiled(self) -> Compiled | None:
        """Return the same as plain arrays, where the likelihood has such a form."""
        found = compiled(self.log_likelihood)
        if found is None or len(self.low) != 4:
            return None
        return found._replace(mapped=True, stiffness=self.stiffness, low=self.low, high=self.high)
