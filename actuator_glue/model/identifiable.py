"""Coordinates of Eq. (2a) under one specimen stiffness, compiled; why: docs/online_method.md."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.normal import below, quantile
from actuator_glue.records import Array

# Strict floating point: the same bits wherever it is inlined.
_njit: Any = partial(njit, fastmath=False)

# Standard deviations beyond this are as good as the bound: 1e-7 of the way from it.
EDGE = 5.2


@_njit
def score(share: float) -> float:
    """Return the normal score of a share of the way between two bounds, inside +-EDGE.

    What is uniform between them is a standard normal coordinate.
    """
    return min(max(quantile(share), -EDGE), EDGE) if share > 0.0 else -EDGE


@_njit
def oil_range(inertia: float, s: float, k: float, low: Array, high: Array) -> tuple[float, float]:
    """Return the range of alpha_2 + k inside the prior's box, given d2/n0 and s; may be empty.

    alpha_1 beta_0 and alpha_3 grow in proportion to it, each inside its own bounds.
    """
    least = max(k + low[2], low[1] * inertia)
    most = min(k + high[2], high[1] * inertia)
    if k > 0.0 and s > 0.0:
        least = max(least, k * low[3] / s)
        most = min(most, k * high[3] / s)
    return least, most


@_njit
def _power(oil: float, k: float) -> float:
    """Return the power of alpha_2 + k in which it is uniform, given the other coordinates."""
    return oil * oil * oil if k > 0.0 else oil * oil


@_njit
def physical(phi: Array, k: float, low: Array, high: Array, theta: Array) -> Any:
    """Fill theta (4,) from coordinates phi (4,), return the log Jacobian less a constant.

    It is minus infinity where theta lies outside low..high. k is the specimen stiffness [N/m].
    """
    inertia = math.exp(phi[1])
    theta[0] = math.exp(phi[0] - phi[1])
    s = 0.0
    if k > 0.0:
        s = phi[3]
        theta[0] -= s
    least, most = oil_range(inertia, s, k, low, high)
    if not (0.0 < most > least and low[0] <= theta[0] <= high[0]):
        return -math.inf
    log_jacobian = phi[0] - 2.0 * phi[1] - 0.5 * phi[2] * phi[2]
    # Given the other coordinates the prior's density of alpha_2 + k rises with its square (k = 0:
    # with itself). In units of `most`, against overflow.
    rest = _power(least / most, k)
    part = rest + (1.0 - rest) * below(phi[2])
    oil = most * (np.cbrt(part) if k > 0.0 else math.sqrt(part))
    log_jacobian += (3.0 if k > 0.0 else 2.0) * math.log(most) + math.log1p(-rest)
    # Inside the box but for rounding.
    theta[1] = min(max(oil / inertia, low[1]), high[1])
    theta[2] = min(max(oil - k, low[2]), high[2])
    if k > 0.0:
        theta[3] = s * oil / k
        if not low[3] <= theta[3] <= high[3]:
            return -math.inf
        return log_jacobian
    theta[3] = low[3] + (high[3] - low[3]) * below(phi[3])
    return log_jacobian - 0.5 * phi[3] * phi[3]


@_njit
def physical_all(
    phi: Array, k: float, low: Array, high: Array, theta: Array, log_jacobian: Array
) -> bool:
    """Fill theta (m, 4) and the log Jacobian (m,); return whether all are inside low..high."""
    inside = True
    for i in range(len(phi)):
        log_jacobian[i] = physical(phi[i], k, low, high, theta[i])
        inside = inside and log_jacobian[i] > -math.inf
    return inside


@_njit
def coordinates_all(theta: Array, k: float, low: Array, high: Array, phi: Array) -> None:
    """Fill phi (m, 4) with the coordinates of physical parameters theta (m, 4)."""
    for i in range(len(theta)):
        oil = max(k + theta[i, 2], 1e-9)
        inertia = oil / max(theta[i, 1], 1e-300)
        s = theta[i, 3] * k / oil
        if k > 0.0:
            phi[i, 3] = s
        else:
            phi[i, 3] = score((theta[i, 3] - low[3]) / (high[3] - low[3]))
        phi[i, 0] = math.log(max((theta[i, 0] + s) * inertia, 1e-300))
        phi[i, 1] = math.log(inertia)
        least, most = oil_range(inertia, s, k, low, high)
        rest = _power(least / most, k)
        phi[i, 2] = score((_power(oil / most, k) - rest) / (1.0 - rest))
