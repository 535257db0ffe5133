"""The strongest bend of a cloud of points: found, taken off, put on again.

A direction `along` and one `across` it: y = z - across h(along.(z - centre)), h(t) = t^2 up to
where the points tell. Since along.across = 0 the map is one-to-one with Jacobian 1, and its
inverse has a plus in place of the minus. Student t's fitted to y are bent distributions of z (the
twisted normal of Haario, Saksman and Tamminen 1999 is one exactly).
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.inference.student import factorize
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Farther out than this, in standard deviations, the bend is not known: it is taken to end there.
_KNOWN = 4.0
# Points looked at, spread evenly over those given.
_MOST = 1000
# Share of the variance across that the bend must explain, and what the search over directions
# finds by chance in m normal points of p dimensions, as a multiple of p^2/m.
_LEAST, _CHANCE = 0.1, 2.0
# Alternating searches for the two directions.
_ROUNDS = 6


@njit(fastmath=False)
def _height(z: Array, centre: Array, along: Array) -> float:
    """Return h at a point (p,)."""
    t = 0.0
    for j in range(len(z)):
        t += along[j] * (z[j] - centre[j])
    return min(t * t, _KNOWN * _KNOWN)


@njit(fastmath=False)
def shift(z: Array, centre: Array, along: Array, across: Array, times: float) -> None:
    """Add so many times the bend at a point z (p,) to it: 1 puts it on, -1 takes it off."""
    h = times * _height(z, centre, along)
    for j in range(len(z)):
        z[j] += h * across[j]


@njit(fastmath=False)
def _whitened(points: Array, centre: Array, factor: Array) -> Array:
    """Return at most `_MOST` of points (m, p) in standard coordinates."""
    m, p = points.shape
    count = min(m, _MOST)
    w = np.empty((count, p))
    for i in range(count):
        row = points[(i * m) // count]
        for j in range(p):
            value = row[j] - centre[j]
            for k in range(j):
                value -= factor[j, k] * w[i, k]
            w[i, j] = value / factor[j, j]
    return w


@njit(fastmath=False)
def _bent(w: Array, a: Array, g: Array) -> float:
    """Write the unit direction g (p,) into which points w bend as they go along a.

    Returns the share of the variance along g that the bend explains.
    """
    m, p = w.shape
    mean = square = 0.0
    total = np.zeros(p)
    g[:] = 0.0
    for i in range(m):
        t = 0.0
        for j in range(p):
            t += a[j] * w[i, j]
        h = min(t * t, _KNOWN * _KNOWN)
        mean += h / m
        square += h * h / m
        for j in range(p):
            g[j] += h * w[i, j] / m
            total[j] += w[i, j] / m
    variance = square - mean * mean
    own = 0.0
    for j in range(p):
        g[j] -= mean * total[j]
        own += g[j] * a[j]
    length = 0.0
    for j in range(p):
        g[j] -= own * a[j]
        length += g[j] * g[j]
    length = math.sqrt(length)
    if not (length > 0.0 and variance > 0.0):
        return 0.0
    for j in range(p):
        g[j] /= length
    return length * length / variance


@njit(fastmath=False)
def _solve(matrix: Array, x: Array) -> None:
    """Solve matrix x = x in place for a positive definite matrix (n, n); both are lost."""
    n = len(x)
    factorize(matrix)
    for j in range(n):
        for i in range(j):
            x[j] -= matrix[j, i] * x[i]
        x[j] /= matrix[j, j]
    for j in range(n - 1, -1, -1):
        for i in range(j + 1, n):
            x[j] -= matrix[i, j] * x[i]
        x[j] /= matrix[j, j]


@njit(fastmath=False)
def _turn(w: Array, g: Array, a: Array) -> float:
    """Turn the unit direction a (p,) to the one along which points w bend into g.

    By least squares: g.w is regressed on 1, w and (a.w) w; the last coefficients say where a
    should point. Returns the slope of the bend.
    """
    m, p = w.shape
    n = 2 * p + 1
    matrix, x, row = np.zeros((n, n)), np.zeros(n), np.empty(n)
    row[0] = 1.0
    for i in range(m):
        t = s = 0.0
        for j in range(p):
            t += a[j] * w[i, j]
            s += g[j] * w[i, j]
        near = min(abs(t), _KNOWN) / max(abs(t), 1e-300)
        for j in range(p):
            # g.w itself explains nothing.
            row[1 + j] = w[i, j] - s * g[j]
            row[1 + p + j] = near * near * t * w[i, j]
        for j in range(n):
            x[j] += row[j] * s
            for k in range(j + 1):
                matrix[j, k] += row[j] * row[k]
    for j in range(n):
        matrix[j, j] += 1e-6 * m
    _solve(matrix, x)
    c = x[1 + p :]
    length = slope = 0.0
    for j in range(p):
        slope += c[j] * a[j]
        length += c[j] * c[j]
    if not length > 0.0:
        return 0.0
    length = math.copysign(math.sqrt(length), slope)
    total = 0.0
    for j in range(p):
        a[j] += c[j] / length
        total += a[j] * a[j]
    for j in range(p):
        a[j] /= math.sqrt(total)
    return slope


@njit(fastmath=False)
def fit(points: Array, centre: Array, factor: Array, along: Array, across: Array) -> bool:
    """Write the bend of points (m, p); zeros, and False, where they show none.

    Args:
        points: at least two.
        centre: their mean, (p,).
        factor: lower Cholesky factor of their covariance, (p, p).
        along: direction, so scaled that along.(z - centre) has unit variance, (p,).
        across: what h is multiplied by, (p,).
    """
    w = _whitened(points, centre, factor)
    m, p = w.shape
    along[:] = 0.0
    across[:] = 0.0
    a, g, best, at = np.zeros(p), np.empty(p), -1.0, 0
    for k in range(p):
        a[k] = 1.0
        share = _bent(w, a, g)
        a[k] = 0.0
        if share > best:
            best, at = share, k
    least = _LEAST + _CHANCE * p * p / m
    # A bend that lies between the axes shows along each of them, though less.
    if best < 0.25 * least:
        return False
    a[at] = 1.0
    slope, share = 0.0, _bent(w, a, g)
    for _ in range(_ROUNDS):
        slope = _turn(w, g, a)
        share = _bent(w, a, g)
    if share < least:
        return False
    for j in range(p):
        for k in range(j + 1):
            across[j] += factor[j, k] * g[k] * slope
    for j in range(p - 1, -1, -1):
        value = a[j]
        for k in range(j + 1, p):
            value -= factor[k, j] * along[k]
        along[j] = value / factor[j, j]
    return True
