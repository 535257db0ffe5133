"""Quantiles of a mixture of normals: posterior draws, each with a residual around it.

By a series about the normal distribution of equal mean and variance where its error bound allows
(docs/online.md, "Band limits"), else component by component.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from actuator_glue.inference.bands import Band, check_levels
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Newton squares its relative error: a last step of 0.5 % leaves 0.005 % of a standard deviation.
_STEPS, _PRECISION = 60, 5e-3
_LEVEL = 1e-10  # between hills the distribution is level, and Newton's steps are lost in rounding
_REACH = 9.0  # standard deviations beyond which there is nothing
_MOST = 24  # terms of the series; where they do not do, components are summed one by one
_SIZE = _MOST + 3  # of their coefficients, which are computed by threes
_TRUNCATION = 3e-5  # of a standard deviation, what the series may leave out
_NEAR = 0.02  # standard deviations from the normal's quantile within which one step is enough
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
    x: Array, inverse: Array, drift: Array, probability: Array, start: Array, limits: Array,
    coming: Array,
) -> None:  # fmt: skip
    """Solve F(limit) = probability, F the mean of normal distribution functions.

    Newton's steps; one that leaves the bracket, or a density that vanishes between components, is
    a bisection.

    Args:
        x: means of the components, (m,).
        inverse: one over their standard deviations, (m,).
        drift: how far each will have moved in the next column, (m,).
        probability: (q,).
        start: where to begin, (q,).
        limits: (q,).
        coming: where the limits will be in the next column: a limit moves as the components that
            lie there do, (q,).
    """
    m = len(x)
    widest = _REACH / inverse.min()
    least, most = x.min() - widest, x.max() + widest
    precise = _PRECISION / inverse.max()
    for q in range(len(probability)):
        low, high = least, most
        new = min(max(start[q], low), high)
        for _ in range(_STEPS):
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


# Factors of the recursion of the bounds b_k: sqrt(k)/(k + 1) and sqrt(k (k - 1))/(k + 1).
_ORDER = np.arange(_MOST + 1.0)
_DRIFT = np.sqrt(_ORDER) / (_ORDER + 1.0)
_SPREAD = np.sqrt(_ORDER * np.maximum(_ORDER - 1.0, 1.0)) / (_ORDER + 1.0)


@njit
def _terms(offset: float, excess: float, wanted: float) -> int:
    """How many terms leave less than `wanted` of sum_k b_k; 0 where even _MOST do not.

    b_k bounds the k-th term at the largest offset and variance excess of any component.
    """
    if excess >= 1.0:
        return 0
    before, last = 1.0, offset  # b_1 = h_1, and h_0 in its place
    for k in range(1, _MOST):
        before, last = last, offset * _DRIFT[k] * last + excess * _SPREAD[k] * before
        p, q = offset * _DRIFT[k + 1], excess
        if k >= 3 and p + q < 1.0 and (p + q) * last + q * before <= wanted * (1.0 - p - q):
            return k + 1
    return 0


@njit
def _coefficients(
    offset: Array, variance: Array, scale: float, terms: int, spare: Array, a: Array
) -> None:
    """Write a_k = mean_i h_k(offset_i, excess_i)/k! for 2 <= k <= terms, and up to two more.

    h_(k+1) = offset h_k + k excess h_(k-1), three at once: most of the time would go into loading
    and storing them.

    Args:
        offset: of the components from the common mean, (m,), to be divided by `scale`.
        variance: of the components, (m,); the excess is that over scale^2, less one.
        scale: common standard deviation.
        terms: how many are wanted.
        spare: scratch, (2, m).
        a: receives them, (_SIZE,).
    """
    m = len(offset)
    before, last = spare[0], spare[1]
    inverse = 1.0 / scale
    square = inverse * inverse
    first = second = third = 0.0
    for i in range(m):
        o, e = offset[i] * inverse, variance[i] * square - 1.0
        two = o * o + e
        three = o * two + 2.0 * e * o
        four = o * three + 3.0 * e * two
        before[i], last[i] = three, four
        first += two
        second += three
        third += four
    factorial = 2.0 * m
    a[2], a[3], a[4] = first / factorial, second / (3.0 * factorial), third / (12.0 * factorial)
    factorial *= 12.0
    for k in range(4, terms, 3):
        first = second = third = 0.0
        for i in range(m):
            o, e = offset[i] * inverse, variance[i] * square - 1.0
            one = o * last[i] + k * e * before[i]
            two = o * one + (k + 1.0) * e * last[i]
            three = o * two + (k + 2.0) * e * one
            before[i], last[i] = two, three
            first += one
            second += two
            third += three
        a[k + 1] = first / (factorial * (k + 1.0))
        a[k + 2] = second / (factorial * (k + 1.0) * (k + 2.0))
        factorial *= (k + 1.0) * (k + 2.0) * (k + 3.0)
        a[k + 3] = third / factorial


@njit
def _hermite(u: float, he: Array) -> None:
    """Write the probabilists' Hermite polynomials at u."""
    he[0] = 1.0
    he[1] = u
    for k in range(1, len(he) - 1):
        he[k + 1] = u * he[k] - k * he[k - 1]


@njit
def _solve(a: Array, terms: int, normal: float, he: Array, spare: Array) -> float:
    """Return u with G(u) = Phi(normal), G(u) = Phi(u) - phi(u) sum_(k>=3) a_k He_(k-1)(u).

    he holds the Hermite polynomials at `normal`; spare is as long.
    """
    lower = here = upper = 0.0
    for k in range(3, terms + 1):
        lower += a[k] * he[k - 1]
        here += a[k] * he[k]
        upper += a[k] * he[k + 1]
    step = lower / (1.0 + here)
    if abs(step) < _NEAR and here > -0.5:
        # One step, with the density's slope: no exponential, no error function.
        return normal + step + 0.5 * step * step * (normal + upper) / (1.0 + here)
    wanted = 0.5 * math.erfc(-normal * 0.7071067811865476)
    u = normal
    for _ in range(_STEPS):
        _hermite(u, spare)
        density = 1.0
        below = 0.0
        for k in range(3, terms + 1):
            below += a[k] * spare[k - 1]
            density += a[k] * spare[k]
        phi = 0.3989422804014327 * math.exp(-0.5 * u * u)
        gap = 0.5 * math.erfc(-u * 0.7071067811865476) - phi * below - wanted
        step = min(max(gap / (phi * max(density, 0.1)), -0.5), 0.5)
        u -= step
        if abs(step) < _PRECISION:
            return u
    return np.nan


@njit
def _largest(values: Array) -> Any:
    """Return the largest modulus of finite values (m,).

    As integers, in whose order moduli are, too: vector units compare those, not numbers that might
    be NaN.
    """
    bits = values.view(np.int64)
    largest = np.int64(0)
    for i in range(len(bits)):
        largest = max(largest, bits[i] & 0x7FFFFFFFFFFFFFFF)
    return np.array([largest]).view(np.float64)[0]


@njit(nogil=True)
def _quantiles(
    columns: Array, mean: Array, sd: Array, probability: Array, normal: Array, out: Array
) -> int:
    """Write quantiles (q, n) of columns (n, m); return how many columns the series did."""
    n, m = columns.shape
    variance, inverse = sd * sd, 1.0 / sd
    between, least, most = variance.mean(), variance.min(), variance.max()
    he = np.empty((len(normal), _MOST + 2))
    for q in range(len(normal)):
        _hermite(normal[q], he[q])
    farthest = np.abs(normal).max()
    wanted = _TRUNCATION / _CRAMER * math.exp(-0.25 * farthest * farthest)
    x, offset, spare = np.empty(m), np.empty(m), np.empty((2, m))
    a, room = np.zeros(_SIZE), np.empty(_MOST + 2)
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
        terms = _terms(_largest(offset) / scale, excess, wanted)
        solved = terms > 0
        if solved:
            _coefficients(offset, variance, scale, terms, spare, a)
            for q in range(len(normal)):
                limits[q] = first + scale * _solve(a, terms, normal[q], he[q], room)
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
