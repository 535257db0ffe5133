"""Quantiles of a mixture of normals: posterior draws, each with a residual around it.

By a series about the normal distribution of equal mean and variance where its error bound allows
(docs/online_method.md, "Band limits"), else component by component.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr, ndtri

from actuator_glue.inference.bands import Band, check_levels
from actuator_glue.jit import njit
from actuator_glue.online.series import (
    MOST,
    PRECISION,
    SIZE,
    STEPS,
    coefficients,
    hermite,
    largest_modulus,
    solve,
    terms_needed,
)
from actuator_glue.records import Array

_LEVEL = 1e-10  # between hills the distribution is level, and Newton's steps are lost in rounding
_REACH = 9.0  # standard deviations beyond which there is nothing
_TRUNCATION = 3e-5  # of a standard deviation, what the series may leave out
_CRAMER = 1.0864349  # |He_n(u)| <= this sqrt(n!) exp(u^2/4)

# Normal distribution function and density at every sixteenth of a standard deviation; Taylor's
# fourth order from the nearest is good to 1e-9, and vector units can read tables.
_GRID = 16.0
_NODES = np.arange(-_REACH, _REACH + 0.5 / _GRID, 1.0 / _GRID)
_BELOW = ndtr(_NODES)
_DENSITY = np.exp(-0.5 * _NODES**2) / math.sqrt(2.0 * math.pi)


@njit
def _sums(at: float, x: Array, inverse: Array, drift: Array) -> tuple[float, float, float]:
    """Return sums over components of distribution function, density, and density times drift."""
    below = density = carried = 0.0
    for i in range(len(x)):
        u = min(max((at - x[i]) * inverse[i], 0.1 - _REACH), _REACH - 0.1)
        node = np.uint32((u + _REACH) * _GRID + 0.5)
        t = node / _GRID - _REACH
        d = u - t
        second, third = t * t - 1.0, t * (t * t - 3.0)
        f = _DENSITY[node]
        below += _BELOW[node] + f * d * (
            1.0 - d * (t / 2.0 - d * (second / 6.0 - d * third / 24.0))
        )
        f *= (1.0 - d * (t - d * (second / 2.0 - d * third / 6.0))) * inverse[i]
        density += f
        carried += f * drift[i]
    return below, density, carried


@njit
def _direct(
    x: Array,
    inverse: Array,
    drift: Array,
    probability: Array,
    start: Array,
    limits: Array,
    coming: Array,
) -> None:
    """Solve F(limit) = probability, F the mean of normal distribution functions.

    Newton's steps; one that leaves the bracket, or a density that vanishes between components, is
    a bisection.

    Args:
        x: means of the components, (m,).
        inverse: one over their standard deviations, (m,).
        drift: how far each will have moved in the next column, (m,).
        probability: of each limit, (q,).
        start: where to begin, (q,).
        limits: receives the solutions, (q,).
        coming: receives the limits expected in the next column: one moves as the components that
            lie there do, (q,).
    """
    m = len(x)
    widest = _REACH / inverse.min()
    least, most = x.min() - widest, x.max() + widest
    precise = PRECISION / inverse.max()
    for q in range(len(probability)):
        low, high = least, most
        new = min(max(start[q], low), high)
        for _ in range(STEPS):
            at = new
            below, density, carried = _sums(at, x, inverse, drift)
            gap = below / m - probability[q]
            if abs(gap) < _LEVEL:
                new = at
                break
            if gap > 0.0:
                high = at
            else:
                low = at
            new = at - gap * m / density
            if not low <= new <= high:
                new = 0.5 * (low + high)
            if abs(new - at) < precise:
                break
        limits[q] = new
        coming[q] = new + carried / density


@njit(nogil=True)
def _quantiles(
    columns: Array, mean: Array, sd: Array, probability: Array, normal: Array, out: Array
) -> int:
    """Write quantiles (q, n) of columns (n, m); return how many columns the series did."""
    n, m = columns.shape
    variance, inverse = sd * sd, 1.0 / sd
    between, least, most = variance.mean(), variance.min(), variance.max()
    he = np.empty((len(normal), MOST + 2))
    for q in range(len(normal)):
        hermite(normal[q], he[q])
    farthest = np.abs(normal).max()
    wanted = _TRUNCATION / _CRAMER * math.exp(-0.25 * farthest * farthest)
    x, offset, spare = np.empty(m), np.empty(m), np.empty((2, m))
    a, room = np.zeros(SIZE), np.empty(MOST + 2)
    limits, start = np.empty(len(normal)), np.empty(len(normal))
    done = 0
    known = False  # whether the column before has told where to start
    for j in range(n):
        first = second = 0.0
        for i in range(m):
            x[i] = columns[j, i] + mean[i]
            first += x[i]
        first /= m
        for i in range(m):
            offset[i] = x[i] - first
            second += offset[i] * offset[i]
        square = second / m + between
        scale = math.sqrt(square)
        excess = max(abs(least / square - 1.0), abs(most / square - 1.0))
        terms = terms_needed(largest_modulus(offset) / scale, excess, wanted)
        solved = terms > 0
        if solved:
            coefficients(offset, variance, scale, terms, spare, a)
            for q in range(len(normal)):
                limits[q] = first + scale * solve(a, terms, normal[q], he[q], room)
                solved = solved and math.isfinite(limits[q])
        if not solved:
            for i in range(m):
                offset[i] = columns[min(j + 1, n - 1), i] - columns[j, i]
            if not known:
                start[:] = first + scale * normal
            _direct(x, inverse, offset, probability, start, limits, start)
        known = not solved
        done += solved
        out[:, j] = limits
    return done


def mixture_band(draws: Array, mean: Array, sd: Array, levels: Sequence[float] | Array) -> Band:
    """Return the central bands of a mixture, sample by sample.

    The same distribution that `inference.predictive.total_band` samples from, computed instead:
    no Monte-Carlo error, and fast enough for every window.

    Args:
        draws: simulated responses, shape (m, n) [m].
        mean: mean of the residual of each draw, shape (m,) [m].
        sd: its standard deviation > 0, shape (m,) [m].
        levels: nominal coverages.

    Raises:
        InputError: a level outside (0, 1).
    """
    wanted = check_levels(levels)
    probability = np.concatenate([(1.0 - wanted) / 2.0, [0.5], (1.0 + wanted) / 2.0])
    out = np.empty((len(probability), draws.shape[1]))
    columns = np.ascontiguousarray(draws.T)
    _quantiles(columns, mean, sd, probability, ndtri(probability), out)
    count = len(wanted)
    return Band(wanted, out[:count], out[count], out[count + 1 :])
