"""Convergence of chains: R-hat and effective sample size.

They are needed after every window, hundreds of times as fast as arviz, whose import alone takes
seconds. test/inference/test_convergence.py holds them to arviz.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from actuator_glue.jit import njit
from actuator_glue.records import Array

# R-hat above which chains have not met at all (the threshold of Gelman and Rubin 1992). Below it
# intervals are about as wide as further draws would make them; above it they say nothing.
APART = 1.2


def rhat(draws: Array) -> Array:
    """Rank-normalised split R-hat of each parameter (Vehtari et al. 2021, Eqs. 3 and 14).

    The larger of the bulk value and the value of the folded draws.

    Args:
        draws: (steps, chains, p).

    Returns:
        (p,); nan for fewer than 4 steps, draws that are not finite, or constant ones.
    """
    return rhat_and_ess(draws)[0]


def ess_bulk(draws: Array) -> Array:
    """Bulk effective sample size of each parameter (Vehtari et al. 2021, section 4.2).

    Arguments and what is returned are as in `rhat`.
    """
    return rhat_and_ess(draws)[1]


def quick_rhat_and_ess(draws: Array) -> tuple[Array, Array]:
    """Return split R-hat and effective sample size without ranks, (p,) each.

    A tenth of the cost of `rhat_and_ess`, and the same where the draws are nearly normal: it may
    decide when to stop, not what is published. Arguments as in `rhat`.
    """
    split = _split(draws)
    if split is None:
        return np.full(draws.shape[2], np.nan), np.full(draws.shape[2], np.nan)
    return np.asarray(_potential_reduction(split)), _effective(split)


def rhat_and_ess(draws: Array) -> tuple[Array, Array]:
    """Return `rhat` and `ess_bulk`, (p,) each, from one ranking of the draws."""
    split = _split(draws)
    if split is None:
        return np.full(draws.shape[2], np.nan), np.full(draws.shape[2], np.nan)
    values = split.reshape(len(split), -1)
    bulk, folded = np.empty_like(split), np.empty_like(split)
    _rank(
        values,
        np.argsort(values, axis=1),
        _scores(values.shape[1]),
        bulk.reshape(values.shape),
        folded.reshape(values.shape),
    )
    reduction = np.maximum(_potential_reduction(bulk), _potential_reduction(folded))
    return reduction, _effective(bulk)


def _split(draws: Array) -> Array | None:
    """(p, 2 chains, steps // 2): each chain's first and last half, the middle dropped.

    None for too few draws, or some that are not finite.
    """
    half = len(draws) // 2
    parts = (draws[:half], draws[len(draws) - half :])
    split = np.ascontiguousarray(np.concatenate(parts, axis=1).T)
    return split if half >= 2 and np.isfinite(split).all() else None


@lru_cache(maxsize=8)
def _scores(count: int) -> Array:
    """Normal scores of the ranks 1, 1.5, 2, ... count (halves are those of ties)."""
    rank = 0.5 * np.arange(2, 2 * count + 1)
    return np.asarray(ndtri((rank - 0.375) / (count + 0.25)))


@njit
def _share(ascending: Array, order: NDArray[np.intp], scores: Array, out: Array) -> None:
    """Write the score of each value's rank to its place; equal values share their mean rank."""
    first, n = 0, len(ascending)
    while first < n:
        equal = 1
        while first + equal < n and ascending[first + equal] == ascending[first]:
            equal += 1
        for i in range(first, first + equal):
            out[order[i]] = scores[2 * first + equal - 1]
        first += equal


@njit(nogil=True)
def _rank(
    values: Array, order: NDArray[np.intp], scores: Array, bulk: Array, folded: Array
) -> None:
    """Write normal scores of rows of values (p, m), and of their distances from the median.

    `order` sorts each row. The distances in order are two sorted halves, merged.
    """
    n = values.shape[1]
    up, far, place = np.empty(n), np.empty(n), np.empty(n, np.int64)
    for row in range(len(values)):
        for i in range(n):
            up[i] = values[row, order[row, i]]
        _share(up, order[row], scores, bulk[row])
        centre = 0.5 * (up[(n - 1) // 2] + up[n // 2])
        left, right = 0, n - 1
        for i in range(n - 1, -1, -1):  # the largest distance is at one of the two ends
            below, above = abs(up[left] - centre), abs(up[right] - centre)
            if below > above:
                far[i], place[i] = below, order[row, left]
                left += 1
            else:
                far[i], place[i] = above, order[row, right]
                right -= 1
        _share(far, place, scores, folded[row])


@njit(fastmath=False)
def _spread(chains: Array) -> tuple[float, float, Array]:
    """Return the mean variance within chains (m, n), and the variance of their means."""
    m, n = chains.shape
    within, centre = 0.0, 0.0
    means = np.empty(m)
    for i in range(m):
        means[i] = 0.0
        for value in chains[i]:
            means[i] += value
        means[i] /= n
        centre += means[i] / m
    between = 0.0
    for i in range(m):
        total = 0.0
        for value in chains[i]:
            total += (value - means[i]) ** 2
        within += total / (n - 1) / m
        between += (means[i] - centre) ** 2 / (m - 1)
    return within, between, means


@njit(fastmath=False)
def _potential_reduction(values: Array) -> Array:
    """sqrt(((n - 1)/n W + B/n) / W) for values (p, chains, n)."""
    chains, n = values.shape[1:]
    found = np.full(len(values), np.nan)
    if n < 2 or chains < 2:
        return found
    for i in range(len(values)):
        within, between, _ = _spread(values[i])
        found[i] = math.sqrt((n - 1) / n + between / within)
    return found


def _effective(values: Array) -> Array:
    """Effective sample size of (p, chains, n): Vehtari et al. (2021), Eqs. (10)-(12)."""
    chains, n = values.shape[1:]
    found = np.full(len(values), np.nan)
    for i, one in enumerate(values):
        within, between, means = _spread(one)
        if within > 0.0:
            time = _correlation_time(one - means[:, np.newaxis], within, between)
            found[i] = n * chains / max(time, 1.0 / np.log10(n * chains))
    return found


# Strict floating point: what is published must not depend on which process compiled it.
@njit(fastmath=False)
def _covariance(values: Array, lag: int) -> Any:
    """Autocovariance at a lag, averaged over chains (m, n) less their means."""
    m, n = values.shape
    total = odd = 0.0
    for i in range(m):
        row = values[i]
        for t in range(0, n - lag - 1, 2):
            total += row[t] * row[t + lag]
            odd += row[t + 1] * row[t + 1 + lag]
        if (n - lag) % 2 == 1:
            total += row[n - lag - 1] * row[n - 1]
    return (total + odd) / (n * m)


@njit(fastmath=False)
def _correlation_time(values: Array, within: float, between: float) -> float:
    """Sum of autocorrelations by Geyer's initial monotone sequence of pairs.

    As in Stan and arviz, the even term of the pair after the last one counts once, unless both it
    and its pair are negative. Lags are summed one by one: chains that mix need few of them.

    Args:
        values: chains less their means, (m, n).
        within: mean variance within them.
        between: variance of their means.
    """
    n = values.shape[1]
    total = _covariance(values, 0) + between
    last = max((n - 3) // 2, 0)
    least, time = math.inf, -1.0
    even, odd = 1.0, 0.0
    for pair in range(last + 1):
        if pair > 0:
            even = 1.0 - (within - _covariance(values, 2 * pair)) / total
        if 2 * pair + 1 < n:
            odd = 1.0 - (within - _covariance(values, 2 * pair + 1)) / total
        if pair == last or even + odd <= 0.0:
            break
        least = min(least, even + odd)
        time += 2.0 * least
    if even < 0.0 and even + odd < 0.0:
        even = 0.0
    return time + even
