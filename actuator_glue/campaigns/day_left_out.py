"""Each day held against what all other days tell of it: cross-validation of the days' model.

Given walk and offset, the level of a day is told by the days before it and, backwards in time, by
the days after it: two filters, neither of which has seen the day itself (two-filter smoother:
Fraser and Potter 1969). The smoothed level of `pooled` is no substitute: it holds the day, and as
it is a mixture over draws of walk and offset, the day cannot be taken out of it again.

The offset of the day that is judged has heavier tails than a normal one, as in robust
meta-analysis (Baker and Jackson 2008): laboratories have an odd day more often than that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from scipy.stats import chi2, norm

from actuator_glue.campaigns.day_model import JUMP, hyper_draws
from actuator_glue.campaigns.pooling import Pooled
from actuator_glue.campaigns.series import Series
from actuator_glue.records import Array

# Of two days nobody knows which is off; one of many hardly tells walk and offset, unless it is
# farther off than this p-value says.
_LEAST, _MANY, _DOUBTFUL = 3, 20, 0.05
# Probability that a history has an outlier by chance, at most.
_OUTLIERS = 0.05
# Standard deviation of a day that tells nothing, and draws of walk and offset without a day.
_NOTHING, _DRAWS = 1e6, 256
_FREEDOM = 4  # of the offset's Student t
# It is a normal one whose variance is inverse chi-square: values of that, and their shares.
_EDGES = np.concatenate([[0.0], expit(np.arange(-14.0, 5.0, 0.5)), [1.0]])
_SHARES = np.diff(_EDGES)
_WIDER = (_FREEDOM - 2.0) / chi2.ppf(_EDGES[:-1] + 0.5 * _SHARES, _FREEDOM)


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """How far each day is from what all other days tell of it.

    Attributes:
        deviation: of its estimate from the level of all other days, logarithms, (n, p).
        p_values: that a day is as far off or farther, of each parameter, (n, p).
    """

    deviation: Array
    p_values: Array

    @property
    def together(self) -> Array:
        """The p-value of each day, of all parameters together, (n,)."""
        return np.asarray(1.0 - (1.0 - self.p_values.min(axis=1)) ** self.p_values.shape[1])

    @property
    def outliers(self) -> NDArray[np.bool_]:
        """Whether a day is so far off that chance puts one in one of 20 histories, (n,)."""
        return np.asarray(self.together < 1.0 - (1.0 - _OUTLIERS) ** (1.0 / len(self.p_values)))


def left_out(series: Series, together: Pooled) -> LeftOut:
    """Return how far each day is from all others; one or two days are not far from anything.

    Args:
        series: the days.
        together: what they tell. Each of its draws of walk and offset is taken by itself, and
            p-values are averaged over them. A day that is far off, or one of few, has too much say
            in these: it gets draws from all others.
    """
    n, p = series.mean.shape
    if n < _LEAST:
        return LeftOut(np.zeros((n, p)), np.ones((n, p)))
    offset = together.offset_draws
    deviation, variance = _held(series, together.walk_draws, offset, together.jumps)
    found = LeftOut(deviation.mean(axis=0), _seldom(deviation, variance, offset[:, None]))
    rng = np.random.default_rng(n)
    for day in range(n) if n < _MANY else np.flatnonzero(found.together < _DOUBTFUL):
        walk, offset = _without(series, together.jumps, day, rng)
        off, spread = (told[:, day] for told in _held(series, walk, offset, together.jumps))
        found.deviation[day], found.p_values[day] = off.mean(axis=0), _seldom(off, spread, offset)
    return found


def _seldom(deviation: Array, variance: Array, offset: Array) -> Array:
    """Return p-values (..., p) of deviations (h, ..., p) with the scatter of days `offset`."""
    p_values = np.zeros(deviation.shape[1:])
    for share, wider in zip(_SHARES, _WIDER, strict=True):
        spread = np.sqrt(variance + (wider - 1.0) * offset**2)
        p_values += share * 2.0 * norm.sf(np.abs(deviation) / spread).mean(axis=0)
    return p_values


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
    """Return deviations from all other days and their variances, (h, n, p) each."""
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
    return series.mean - level, np.diagonal(scatter + covariance, axis1=2, axis2=3)


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
