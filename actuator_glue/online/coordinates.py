"""Coordinates in which one record determines each base parameter by itself, or not at all.

Under one specimen stiffness k, Eq. (2a) divided by d2 has three coefficients:

    n0/d2 = r,   d1/d2 = beta_1 + s,   d0/d2 = r + beta_1 s,
    r = alpha_1 beta_0/(k + alpha_2),   s = alpha_3 k/(k + alpha_2).

The posterior of one record is therefore a ridge, a thousand times longer than wide and bent, on
which a sampler in the physical parameters creeps. In d1/d2 (damping), ln d0/d2 (stiffness),
alpha_2 and s it is nearly a box: alpha_2 alone runs along the ridge. The prior stays uniform in
the physical parameters; its density in these coordinates is the Jacobian,
(d0/d2) (k + alpha_2)^2/k. At k = 0 alpha_3 does not act and stays as it is, with s = 0 and
Jacobian (d0/d2) alpha_2.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from actuator_glue.inference.chains import Chains
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.jit import njit
from actuator_glue.online.settings import ModelChoice
from actuator_glue.records import Array

# No servo-hydraulic actuator has its natural frequency outside 0.05 .. 1000 Hz; the logarithm
# needs limits, since the prior reaches alpha_2 = 0.
_STIFFNESS = tuple(float(np.log((2.0 * np.pi * f) ** 2)) for f in (0.05, 1000.0))


@njit
def _physical(phi, k, low, high, theta, log_jacobian):  # type: ignore[no-untyped-def]
    """Fill theta (m, p) and the log Jacobian (m,), minus infinity outside low..high.

    Returns whether all are inside.
    """
    all_inside = True
    for i in range(len(phi)):
        theta[i] = phi[i]
        oil = k + phi[i, 2]
        rate = math.exp(phi[i, 1])
        log_jacobian[i] = phi[i, 1] + (2.0 if k > 0.0 else 1.0) * math.log(oil)
        if k > 0.0:
            s = phi[i, 3]
            theta[i, 0] = phi[i, 0] - s
            rate -= theta[i, 0] * s
            theta[i, 3] = s * oil / k
        theta[i, 1] = rate * oil
        for j in range(phi.shape[1]):
            if not low[j] <= theta[i, j] <= high[j]:
                log_jacobian[i] = -np.inf
                all_inside = False
                break
    return all_inside


class Coordinates:
    """Maps physical parameters (m, p) to sampling coordinates and back, for one stiffness.

    Args:
        model: gives the prior's box; parameters of effects are left as they are.
        stiffness: specimen stiffness k [N/m].
    """

    def __init__(self, model: ModelChoice, stiffness: float) -> None:
        self._low, self._high = model.bounds
        self._k = stiffness
        self.lower, self.upper = self._low.copy(), self._high.copy()
        self.lower[1], self.upper[1] = _STIFFNESS
        if stiffness > 0.0:
            self.lower[3] *= stiffness / (stiffness + self._high[2])
            self.upper[3] *= stiffness / (stiffness + self._low[2])
            self.lower[0] += self.lower[3]
            self.upper[0] += self.upper[3]
        # The sampler takes logarithms above a lower bound of 0, which straightens a ridge that is
        # straight already. A bound just below is none; the prior's box is checked all the same.
        edge = self.lower[:4] == 0.0
        self.lower[:4][edge] = -1e-6 * self.upper[:4][edge]

    def physical(self, phi: Array) -> Array:
        """Return physical parameters of coordinates, (..., p)."""
        flat = np.ascontiguousarray(phi).reshape(-1, len(self._low))
        theta = np.empty_like(flat)
        _physical(flat, self._k, self._low, self._high, theta, np.empty(len(flat)))
        return theta.reshape(phi.shape)

    def coordinates(self, theta: Array) -> Array:
        """Return coordinates of physical parameters, (..., p), moved inside their bounds."""
        phi = np.array(theta, dtype=np.float64)
        oil = np.maximum(self._k + phi[..., 2], 1e-9)
        rate = phi[..., 1] / oil
        if self._k > 0.0:
            s = phi[..., 3] * self._k / oil
            rate += phi[..., 0] * s
            phi[..., 0] += s
            phi[..., 3] = s
        phi[..., 1] = np.log(np.maximum(rate, 1e-300))
        return np.clip(phi, self.lower, self.upper)

    def log_jacobian(self, phi: Array) -> Array:
        """Return the log prior density in the coordinates, (...,), less a constant."""
        power = 2.0 if self._k > 0.0 else 1.0
        return np.asarray(phi[..., 1] + power * np.log(self._k + phi[..., 2]))

    def density(self, log_likelihood: LogDensity) -> Callable[[Array], Array]:
        """Return the log posterior density of coordinates (m, p) -> (m,)."""

        def log_density(phi: Array) -> Array:
            theta, values = np.empty_like(phi), np.empty(len(phi))
            if _physical(phi, self._k, self._low, self._high, theta, values):
                values += log_likelihood(theta)
                return values
            # Outside the prior's box the likelihood may be slow, and is not needed.
            inside = np.isfinite(values)
            if inside.any():
                values[inside] += log_likelihood(np.ascontiguousarray(theta[inside]))
            return values

        return log_density

    def chains(self, sampled: Chains) -> Chains:
        """Return chains of coordinates as chains of physical parameters with log likelihoods."""
        return replace(
            sampled,
            draws=self.physical(sampled.draws),
            log_density=sampled.log_density - self.log_jacobian(sampled.draws),
        )
