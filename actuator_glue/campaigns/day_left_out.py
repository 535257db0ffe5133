"""Each day held against what all other days tell of it: cross-validation of the days' model.

Given walk and offset, the level of a day is told by the days before it and, backwards in time, by
the days after it: two filters, neither of which has seen the day itself (two-filter smoother:
Fraser and Potter 1969). The smoothed level of `pooled` is no substitute: it holds the day, and as
it is a mixture over draws of walk and offset, the day cannot be taken out of it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from actuator_glue.campaigns.day_model import JUMP, hyper_draws
from actuator_glue.campaigns.pooling import Pooled
from actuator_glue.campaigns.series import Series
from actuator_glue.records import Array

# Of two days nobody knows which is off; one of many hardly tells walk and offset.
_LEAST, _MANY = 3, 20
# Standard deviation of a day that tells nothing, and draws of walk and offset without a day.
_NOTHING, _DRAWS = 1e6, 256
_PRIOR = 3.0  # of p-values of few days


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """How far each day is from what all other days tell of it.

    Attributes:
        deviation: of its estimate from the level of all other days, logarithms, (n, p).
        stddev: of such a deviation, or of a normal one that is as seldom, (n, p).
        p_value: that a day is as far off or farther, all parameters together, (n,).
    """

    deviation: Array
    stddev: Array
    p_value: Array


def left_out(series: Series, together: Pooled) -> LeftOut:
    """Return how far each day is from all others; a single day is not far from anything.

    Args:
        series: the days.
        together: what they tell. Each of its draws of walk and offset is taken by itself, and
            p-values are averaged over them. The day has its say in these draws, which matters
            where days are few: there each has draws from all others.
    """
    n, p = series.mean.shape
    if n == 1:
        return LeftOut(np.zeros((1, p)), np.full((1, p), np.inf), np.ones(1))
    if not _LEAST <= n < _MANY:
        return _told(*_held(series, together.walk_draws, together.offset_draws, together.jumps))
    rng = np.random.default_rng(n)
    rest = [_without(series, together.jumps, t, rng) for t in range(n)]
    days = [_held(series, *hyper, together.jumps) for hyper in rest]
    deviation, spread = (
        np.stack([day[k][:, t] for t, day in enumerate(days)], axis=1) for k in (0, 1)
    )
    # Walk and offset are hardly known: tails are heavy. Averaged for one parameter they nearly
    # hold their level; those of a sum of squares of several would not. Nearly: the prior has most
    # offsets below what a test knows, so that one in 10 histories of 5 to 12 days had an outlier
    # by chance; with a factor of 2 it is one in 18 (2400 histories), with 3 one in 33 (500).
    far = np.abs(deviation) / np.sqrt(np.diagonal(spread, axis1=2, axis2=3))
    each = np.clip(2.0 * norm.sf(far).mean(axis=0), 1e-300, 1.0 - 1e-9)
    middle = deviation.mean(axis=0)
    alike = np.abs(middle) / norm.isf(0.5 * each)
    p_value = np.minimum(_PRIOR * (1.0 - (1.0 - each.min(axis=1)) ** p), 1.0)
    return LeftOut(middle, alike, p_value)


def _without(
    series: Series, jumps: Sequence[int], day: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return draws (h, p) of walk and offset from all days but one."""
    deviations = np.sqrt(np.diagonal(series.covariance, axis1=1, axis2=2))
    deviations[day] = _NOTHING
    found = [
        hyper_draws(series.times, y, s, jumps, _DRAWS, rng)
        for y, s in zip(series.mean.T, deviations.T, strict=True)
    ]
    return np.array([w for w, _ in found]).T, np.array([o for _, o in found]).T


def _held(series: Series, walk: Array, offset: Array, jumps: Sequence[int]) -> tuple[Array, Array]:
    """Return deviations (h, n, p) from all other days and their covariances (h, n, p, p)."""
    scatter = _diagonal(offset**2)[:, None] + series.covariance
    between = walk[:, None] ** 2 * np.diff(series.times)[:, None]
    between[:, [k - 1 for k in jumps]] += JUMP**2
    steps = _diagonal(between)
    early, early_c = _told_before(series.mean, scatter, steps)
    late, late_c = (
        x[:, ::-1] for x in _told_before(series.mean[::-1], scatter[:, ::-1], steps[:, ::-1])
    )
    # The first day is told by later ones alone, the last by earlier ones.
    level = np.concatenate([late[:, :1], early], axis=1)
    covariance = np.concatenate([late_c[:, :1], early_c], axis=1)
    a, b = early_c[:, :-1], late_c[:, 1:]
    gain = np.linalg.solve(a + b, a).swapaxes(2, 3)
    level[:, 1:-1] += np.einsum('htab,htb->hta', gain, late[:, 1:] - early[:, :-1])
    covariance[:, 1:-1] -= gain @ a
    return series.mean - level, scatter + covariance


def _told(deviation: Array, spread: Array) -> LeftOut:
    """Return what deviations (h, n, p) with covariances (h, n, p, p) tell together."""
    weighed = np.linalg.solve(spread, deviation[..., None])[..., 0]
    p_values = chi2.sf((deviation * weighed).sum(axis=2), deviation.shape[2])
    variances = np.diagonal(spread, axis1=2, axis2=3)
    return LeftOut(
        deviation=deviation.mean(axis=0),
        stddev=np.sqrt(variances.mean(axis=0) + deviation.var(axis=0)),
        p_value=p_values.mean(axis=0),
    )


def _diagonal(variances: Array) -> Array:
    """Return diagonal matrices (..., p, p) of some variances (..., p)."""
    return np.asarray(variances[..., None] * np.eye(variances.shape[-1]))


def _told_before(y: Array, scatter: Array, steps: Array) -> tuple[Array, Array]:
    """Return what the days before each day but the first tell of its level (Kalman filter).

    Args:
        y: estimates in their order, (n, p).
        scatter: covariance of an estimate around its level, (h, n, p, p).
        steps: covariance of what the level walks from a day to the next one, (h, n - 1, p, p).

    Returns:
        Means (h, n - 1, p) and covariances (h, n - 1, p, p); nothing is known at the start.
    """
    h, n, p, _ = scatter.shape
    means, covariances = np.empty((h, n - 1, p)), np.empty((h, n - 1, p, p))
    m, c = np.broadcast_to(y[0], (h, p)), scatter[:, 0]
    for t in range(1, n):
        c = c + steps[:, t - 1]
        means[:, t - 1], covariances[:, t - 1] = m, c
        gain = np.linalg.solve(c + scatter[:, t], c).swapaxes(1, 2)
        m = m + np.einsum('hab,hb->ha', gain, y[t] - m)
        c = c - gain @ c
        c = 0.5 * (c + c.swapaxes(1, 2))
    return means, covariances
