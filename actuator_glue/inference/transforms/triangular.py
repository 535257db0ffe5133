"""Triangular transport (Knothe-Rosenblatt): what an earlier posterior bends, straightened.

Points of the earlier posterior tell each coordinate's mean given those before it, as a quadratic
function; the straight coordinates are what is left, in standard deviations (a map of second
degree). Its Jacobian is constant. The map is fixed before the window is sampled and
one-to-one whatever the points were, so it makes the sampler faster, never wrong.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.records import Array

_njit: Any = partial(njit, fastmath=False)

# Farther out than this, in standard deviations, the bend is not known: it is taken to end there.
_KNOWN = 4.0
# Prior weight of 'no bend', as a share of the points.
_SHRINK = 0.01
# Limits of the straight coordinates in standard deviations: nothing of a posterior is so far out.
_LIMIT = 1e5


@_njit
def _mean(y: Array, axis: int, coefficients: Array) -> Any:
    """Mean of one coordinate of y (in standard units), given those before it."""
    total, at = coefficients[axis, 0], 1
    for a in range(axis):
        total += coefficients[axis, at] * y[a]
        at += 1
    for a in range(axis):
        here = min(max(y[a], -_KNOWN), _KNOWN)
        for b in range(a, axis):
            total += coefficients[axis, at] * here * min(max(y[b], -_KNOWN), _KNOWN)
            at += 1
    return total


@_njit
def _bent(v: Array, width: Array, coefficients: Array, y: Array) -> None:
    for i in range(len(v)):
        for j in range(v.shape[1]):
            y[i, j] = width[j] * v[i, j] + _mean(y[i], j, coefficients)


@_njit
def _straight(y: Array, width: Array, coefficients: Array, v: Array) -> None:
    for i in range(len(y)):
        for j in range(y.shape[1]):
            v[i, j] = (y[i, j] - _mean(y[i], j, coefficients)) / width[j]


class Triangular:
    """Transform of coordinates y (m, p) to straight ones z.

    Effects come first, then what one record leaves free, then what it fixes best.

    Args:
        points: an earlier posterior in coordinates y, shape (m, p), m > 2 p.
    """

    def __init__(self, points: Array) -> None:
        m, p = points.shape
        self.lower, self.upper = np.full(p, -_LIMIT), np.full(p, _LIMIT)
        self._order = np.array([*range(p - 1, 3, -1), 2, 3, 1, 0][-p:])
        points = points[:, self._order]
        self._centre = points.mean(axis=0)
        # Never zero: points all equal in a coordinate get the spread of rounding.
        self._scale = np.maximum(points.std(axis=0), 1e-12 * (1.0 + np.abs(self._centre)))
        y = (points - self._centre) / self._scale
        known = np.clip(y, -_KNOWN, _KNOWN)
        self._mean = np.zeros((p, 1 + p + p * (p + 1) // 2))
        self._width = np.ones(p)
        for axis in range(p):
            squares = [known[:, a] * known[:, b] for a in range(axis) for b in range(a, axis)]
            table = np.stack([np.ones(m), *y[:, :axis].T, *squares], axis=1)
            weight = np.full(table.shape[1], _SHRINK * m)
            weight[: 1 + axis] = 1e-9 * m
            found = np.linalg.solve(table.T @ table + np.diag(weight), table.T @ y[:, axis])
            self._mean[axis, : len(found)] = found
            self._width[axis] = max(float((y[:, axis] - table @ found).std()), 1e-9)

    def forward(self, x: Array) -> Array:
        """Return straight coordinates (m, p) of coordinates (m, p)."""
        z = np.empty_like(x)
        _straight((x[:, self._order] - self._centre) / self._scale, self._width, self._mean, z)
        return np.clip(z, self.lower, self.upper)

    def inverse(self, z: Array) -> tuple[Array, Array]:
        """Return y (m, p) of straight coordinates (m, p), and zeros (m,): |dy/dz| is constant."""
        y, x = np.empty_like(z), np.empty_like(z)
        _bent(z, self._width, self._mean, y)
        x[:, self._order] = self._centre + self._scale * y
        return x, np.zeros(len(z))
