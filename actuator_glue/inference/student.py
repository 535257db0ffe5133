"""Student-t distribution fitted to points: its density and its draws.

Heavy tails (8 degrees of freedom) keep the ratio to any density with Gaussian tails bounded.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.normal import quantile
from actuator_glue.records import Array

DEGREES = 8.0


@njit
def factorize(matrix: Array) -> None:
    """Replace a positive definite matrix (n, n) by its Cholesky factor, in its lower triangle.

    By hand: what libraries return may depend on how many threads they use.
    """
    for j in range(len(matrix)):
        for k in range(j + 1):
            for i in range(k):
                matrix[j, k] -= matrix[j, i] * matrix[k, i]
            if k < j:
                matrix[j, k] /= matrix[k, k]
        matrix[j, j] = math.sqrt(max(matrix[j, j], 1e-300))


@njit(fastmath=False)
def fit(points: Array, centre: Array, factor: Array) -> None:
    """Write centre (p,) and lower Cholesky factor (p, p) of the covariance of points (m, p).

    The covariance is shrunk towards its diagonal as far as few points need it.
    """
    m, d = points.shape
    centre[:] = 0.0
    factor[:] = 0.0
    for i in range(m):
        for j in range(d):
            centre[j] += points[i, j]
    centre /= m
    residual = np.empty(d)
    for i in range(m):
        for j in range(d):
            residual[j] = points[i, j] - centre[j]
            for k in range(j + 1):
                factor[j, k] += residual[j] * residual[k]
    share = (d + 1.0) / (m + d + 1.0)
    for j in range(d):
        for k in range(j):
            factor[j, k] *= (1.0 - share) / max(m - 1, 1)
        # Never singular: points all equal in a coordinate get the spread of rounding.
        least = 1e-16 * (1.0 + centre[j] * centre[j])
        factor[j, j] = max(factor[j, j] / max(m - 1, 1), least) * (1.0 + 1e-9)
    factorize(factor)


@njit
def distance2(z: Array, centre: Array, factor: Array, residual: Array) -> float:
    """Squared Mahalanobis distance of z from the centre; residual is scratch (p,)."""
    total = 0.0
    for j in range(z.size):
        value = z[j] - centre[j]
        for k in range(j):
            value -= factor[j, k] * residual[k]
        residual[j] = value / factor[j, j]
        total += residual[j] * residual[j]
    return total


@njit
def log_density(z: Array, centre: Array, factor: Array) -> Array:
    """Log density (m,) of the fitted Student t at points z (m, p), less a constant."""
    values = np.empty(z.shape[0])
    residual = np.empty(z.shape[1])
    for i in range(z.shape[0]):
        away = distance2(z[i], centre, factor, residual)
        values[i] = -0.5 * (DEGREES + z.shape[1]) * math.log1p(away / DEGREES)
    return values


@njit
def draw(uniforms: Array, first: int, centre: Array, factor: Array, candidate: Array) -> float:
    """Write one draw of the fitted Student t into candidate, from uniforms[first:].

    Returns its squared Mahalanobis distance from the centre.
    """
    d = centre.size
    # Chi-squared with eight degrees of freedom: four exponentials.
    product = 1.0
    for i in range(4):
        product *= 1.0 - uniforms[first + i]
    stretch = math.sqrt(-0.5 * DEGREES / math.log(product))
    total = 0.0
    for j in range(d):
        candidate[j] = centre[j]
    for k in range(d):
        step = stretch * quantile(uniforms[first + 4 + k])
        total += step * step
        for j in range(k, d):
            candidate[j] += factor[j, k] * step
    return total


@njit
def draw_all(uniforms: Array, centre: Array, factor: Array) -> Array:
    """Return draws (m, p) of the fitted Student t from uniforms (m, p + 4)."""
    points = np.empty((len(uniforms), len(centre)))
    for i in range(len(uniforms)):
        draw(uniforms[i], 0, centre, factor, points[i])
    return points
