"""Unbounded coordinates: a bounded uniform prior becomes a density on the whole of R^p.

Every coordinate x in (lower, upper) is carried as z = ln((x - lower) / (upper - x)). Proposals
made in z can never leave the prior, so no reflection is needed, and parameters that differ by nine
orders of magnitude all live on the same scale. The density of z is the density of x times the
Jacobian dx/dz = (x - lower)(upper - x) / (upper - lower); see docs/dream.md for why folding at the
bounds is not exact for correlated jumps.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Closest relative distance to a bound that a given start point may have: keeps z finite.
_EDGE = 1e-12


@njit
def bounded(z, lower, width, x):  # type: ignore[no-untyped-def]
    """Write the physical point of z into x, both (p,); return its log Jacobian less a constant."""
    # ln(share (1 - share)) = -|z| - 2 ln(1 + exp(-|z|)); the logarithms wait in one product.
    far = 0.0
    product = 1.0
    for j in range(z.size):
        size = abs(z[j])
        small = math.exp(-size)
        share = (1.0 if z[j] > 0.0 else small) / (1.0 + small)
        x[j] = lower[j] + width[j] * share
        far += size
        product *= 1.0 + small
        if product > 1e300:
            far += 2.0 * math.log(product)
            product = 1.0
    return -far - 2.0 * math.log(product)


@njit
def bounded_all(z, lower, width):  # type: ignore[no-untyped-def]
    """Return physical points (m, p) and log Jacobians (m,) of the points z (m, p)."""
    x = np.empty_like(z)
    log_jacobian = np.empty(z.shape[0])
    for i in range(z.shape[0]):
        log_jacobian[i] = bounded(z[i], lower, width, x[i])
    return x, log_jacobian


def unbounded(x: Array, lower: Array, width: Array) -> Array:
    """Return the unbounded coordinates of physical points x (m, p) [physical units]."""
    share = np.clip((x - lower) / width, _EDGE, 1.0 - _EDGE)
    return np.ascontiguousarray(np.log(share) - np.log1p(-share))


def check_bounds(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return lower bounds and widths (p,) of a uniform prior.

    Raises:
        InputError: bounds are not finite, of unequal length, or lower is not below upper.
    """
    low = np.array(lower, dtype=np.float64).reshape(-1)
    high = np.array(upper, dtype=np.float64).reshape(-1)
    if low.shape != high.shape or low.size == 0:
        raise InputError(f'prior bounds have lengths {low.size} and {high.size}')
    wrong = ~(np.isfinite(low) & np.isfinite(high) & (low < high))
    if wrong.any():
        at = int(wrong.argmax())
        raise InputError(
            f'prior bounds of parameter {at} are ({low[at]:g}, {high[at]:g}); '
            'a uniform prior needs two finite bounds, the lower one first'
        )
    return low, high - low
