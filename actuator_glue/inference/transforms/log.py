"""Logarithms of what is positive by its prior, the rest on a unit scale: the sampler's own.

A parameter with lower bound 0 is carried as z = ln(x / upper), any other as z = (x - lower) /
(upper - lower). Parameters that differ by nine orders of magnitude then live on one scale, a ratio
that the data fix while they say nothing about its two parts is a straight line, and mass piled up
at 0 has no wall. A candidate beyond a wall that remains has density zero and is rejected;
docs/dream.md says why it is not folded back. The density of z is that of x times dx/dz.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Closest relative distance to a bound that a given start point may have: keeps z finite.
_EDGE = 1e-12


@njit
def physical(z: Array, lower: Array, width: Array, x: Array) -> float:
    """Write the physical point of z into x, both (p,); return ln |dx/dz| less a constant.

    Beyond a bound the logarithm is minus infinity and x lies on the bound.
    """
    log_jacobian = 0.0
    for j in range(z.size):
        if lower[j] == 0.0:
            share = math.exp(min(z[j], 0.0))
            log_jacobian += z[j] if z[j] < 0.0 else -np.inf
        else:
            share = min(max(z[j], 0.0), 1.0)
            if share != z[j]:
                log_jacobian = -np.inf
        x[j] = lower[j] + width[j] * share
    return log_jacobian


@njit
def physical_all(z: Array, lower: Array, width: Array) -> tuple[Array, Array]:
    """Return physical points (m, p) and log Jacobians (m,) of the points z (m, p)."""
    x = np.empty_like(z)
    log_jacobian = np.empty(z.shape[0])
    for i in range(z.shape[0]):
        log_jacobian[i] = physical(z[i], lower, width, x[i])
    return x, log_jacobian


class Log:
    """Transform of a box: logarithms of what is positive by its prior, the rest on a unit scale.

    Args:
        low: lower bounds of the parameters, (p,).
        high: upper bounds, (p,).

    Raises:
        InputError: bounds are not finite, of unequal length, or low is not below high.
    """

    def __init__(self, low: ArrayLike, high: ArrayLike) -> None:
        self.low, self.width = _checked(low, high)
        positive = self.low == 0.0
        self.lower = np.where(positive, -np.inf, 0.0)
        self.upper = np.where(positive, 0.0, 1.0)

    def forward(self, x: Array) -> Array:
        """Return the coordinates (m, p) of parameters (m, p) inside the box."""
        share = np.clip((x - self.low) / self.width, _EDGE, 1.0 - _EDGE)
        positive = self.low == 0.0
        share[:, positive] = np.log(share[:, positive])
        return np.ascontiguousarray(share)

    def inverse(self, z: Array) -> tuple[Array, Array]:
        """Return the parameters (m, p) of coordinates (m, p), and ln |dx/dz| (m,)."""
        x, log_jacobian = physical_all(z, self.low, self.width)
        return x, log_jacobian


def _checked(low: ArrayLike, high: ArrayLike) -> tuple[Array, Array]:
    """Return lower bounds and widths (p,) of a box."""
    lower = np.array(low, dtype=np.float64).reshape(-1)
    upper = np.array(high, dtype=np.float64).reshape(-1)
    if lower.shape != upper.shape or lower.size == 0:
        raise InputError(f'prior bounds have lengths {lower.size} and {upper.size}')
    wrong = ~(np.isfinite(lower) & np.isfinite(upper) & (lower < upper))
    if wrong.any():
        at = int(wrong.argmax())
        raise InputError(
            f'prior bounds of parameter {at} are ({lower[at]:g}, {upper[at]:g}); '
            'a uniform prior needs two finite bounds, the lower one first'
        )
    return lower, upper - lower
