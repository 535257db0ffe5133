"""Quantiles by a series about the normal distribution of equal mean and variance.

Edgeworth's series; an error bound says how many terms do (docs/online_method.md, "Band limits").
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.records import Array

# Newton squares its relative error: a last step of 0.5 % leaves 0.005 % of a standard deviation.
STEPS, PRECISION = 60, 5e-3
MOST = 24  # terms of the series; where these are too few, components are summed one by one
SIZE = MOST + 3  # number of coefficients, which are computed by threes
_NEAR = 0.02  # standard deviations from the normal's quantile within which one step is enough

# Factors of the recursion of the bounds b_k: sqrt(k)/(k + 1) and sqrt(k (k - 1))/(k + 1).
_ORDER = np.arange(MOST + 1.0)
_DRIFT = np.sqrt(_ORDER) / (_ORDER + 1.0)
_SPREAD = np.sqrt(_ORDER * np.maximum(_ORDER - 1.0, 1.0)) / (_ORDER + 1.0)


@njit
def terms_needed(offset: float, excess: float, wanted: float) -> int:
    """Return how many terms leave a remainder of sum_k b_k below `wanted`; 0 if MOST do not.

    b_k bounds the k-th term at the largest offset and variance excess of any component.
    """
    if excess >= 1.0:
        return 0
    before, last = 1.0, offset  # b_1 = h_1, and h_0 in its place
    for k in range(1, MOST):
        before, last = last, offset * _DRIFT[k] * last + excess * _SPREAD[k] * before
        p, q = offset * _DRIFT[k + 1], excess
        if k >= 3 and p + q < 1.0 and (p + q) * last + q * before <= wanted * (1.0 - p - q):
            return k + 1
    return 0


@njit
def coefficients(
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
        a: receives the coefficients, (SIZE,).
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
def hermite(u: float, he: Array) -> None:
    """Write the probabilists' Hermite polynomials at u."""
    he[0] = 1.0
    he[1] = u
    for k in range(1, len(he) - 1):
        he[k + 1] = u * he[k] - k * he[k - 1]


@njit
def solve(a: Array, terms: int, normal: float, he: Array, spare: Array) -> float:
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
    for _ in range(STEPS):
        hermite(u, spare)
        density = 1.0
        below = 0.0
        for k in range(3, terms + 1):
            below += a[k] * spare[k - 1]
            density += a[k] * spare[k]
        phi = 0.3989422804014327 * math.exp(-0.5 * u * u)
        gap = 0.5 * math.erfc(-u * 0.7071067811865476) - phi * below - wanted
        step = min(max(gap / (phi * max(density, 0.1)), -0.5), 0.5)
        u -= step
        if abs(step) < PRECISION:
            return u
    return np.nan


@njit
def largest_modulus(values: Array) -> Any:
    """Return the largest modulus of finite values (m,).

    Bit patterns are compared as integers, which have the same order: vector units can do that, but
    not compare numbers that might be NaN.
    """
    bits = values.view(np.int64)
    largest = np.int64(0)
    for i in range(len(bits)):
        largest = max(largest, bits[i] & 0x7FFFFFFFFFFFFFFF)
    return np.array([largest]).view(np.float64)[0]
