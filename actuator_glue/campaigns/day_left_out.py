"""Each day held against what all other days tell of it: cross-validation of the days' model.

Given walk and offset, the level of a day is told by the days before it and, backwards in time, by
the days after it: two filters, neither of which has seen the day itself (two-filter smoother:
Fraser and Potter 1969). The smoothed level of `pooled` is no substitute: it holds the day, and as
it is a mixture over draws of walk and offset, the day cannot be taken out of it again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from actuator_glue.campaigns.day_model import JUMP
from actuator_glue.campaigns.pooling import Pooled
from actuator_glue.campaigns.series import Series
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """How far each day is from what all other days tell of it.

    Attributes:
        deviation: of its estimate from the level of all other days, logarithms, (n, p).
        stddev: of such a deviation, (n, p).
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
            p-values are averaged over them. The day has its say in these draws: p-values below
            5 % are fewer than 5 %, the fewer the shorter the history.
    """
    n, p = series.mean.shape
    if n == 1:
        return LeftOut(np.zeros((1, p)), np.full((1, p), np.inf), np.ones(1))
    scatter = _diagonal(together.offset_draws**2)[:, None] + series.covariance
    between = together.walk_draws[:, None] ** 2 * np.diff(series.times)[:, None]
    between[:, [k - 1 for k in together.jumps]] += JUMP**2
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
    deviation, spread = series.mean - level, scatter + covariance
    weighed = np.linalg.solve(spread, deviation[..., None])[..., 0]
    p_values = chi2.sf((deviation * weighed).sum(axis=2), p)
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
