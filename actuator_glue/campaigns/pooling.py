"""All tests of an actuator as one: its level, its days, and what the next test will find."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator_glue.campaigns.change_points import ChangePoint
from actuator_glue.campaigns.day_model import DIFFUSE, JUMP, hyper_draws
from actuator_glue.campaigns.series import Series
from actuator_glue.records import Array

# Values of walk and offsets that stand for their posterior.
_HYPER = 32
# Draws of what the next test will find, of each of these.
_EACH = 125


@dataclass(frozen=True, slots=True, eq=False)
class Pooled:
    """What all tests say of the actuator, on the scale of logarithms.

    Attributes:
        names: the parameters, (p,).
        mean, stddev: of the parameters on each day, (n, p).
        level, level_stddev: of the level that days scatter around, (n, p).
        walk: median of what a level walks in a root of a day, (p,).
        offset: median of the scatter of days, (p,).
        walk_draws, offset_draws: draws of both from their posterior, (h, p).
        jumps: places before which levels jump.
        next_draws: what the next test will find, SI units, (m, p).
        ahead: days from the last one to that test.
    """

    names: tuple[str, ...]
    mean: Array
    stddev: Array
    level: Array
    level_stddev: Array
    walk: Array
    offset: Array
    walk_draws: Array
    offset_draws: Array
    jumps: tuple[int, ...]
    next_draws: Array
    ahead: float

    def interval(self, day: int) -> tuple[Array, Array]:
        """Return the 95 % limits of the parameters on one day, SI units, (p,)."""
        low = np.exp(self.mean[day] - 1.96 * self.stddev[day])
        return low, np.exp(self.mean[day] + 1.96 * self.stddev[day])

    def next_interval(self) -> tuple[Array, Array]:
        """Return the 95 % limits of the parameters at the next test, SI units, (p,)."""
        low, high = np.quantile(self.next_draws, (0.025, 0.975), axis=0)
        return low, high


def pooled(
    series: Series,
    changes: Sequence[ChangePoint] = (),
    ahead: float | None = None,
    seed: int = 1,
) -> Pooled:
    """Return the posterior of every day given all days (Kalman filter and smoother).

    Args:
        series: the days.
        changes: where levels jump.
        ahead: days from the last one to the next test; None for the median between days.
        seed: of the draws.
    """
    n, p = series.mean.shape
    rng = np.random.default_rng((seed, n))
    jumps = {c.place for c in changes}
    hyper = [
        hyper_draws(
            series.times,
            series.mean[:, i],
            np.sqrt(series.covariance[:, i, i]),
            jumps,
            _HYPER,
            rng,
        )
        for i in range(p)
    ]
    walk = np.array([w for w, _ in hyper]).T
    offset = np.array([o for _, o in hyper]).T
    means, covariances = _smoothed(series, jumps, walk, offset)
    days, levels = means[:, :, :p] + means[:, :, p:], means[:, :, :p]
    together = np.concatenate([np.eye(p), np.eye(p)], axis=1)
    spread = np.einsum('ia,ntab,ib->nti', together, covariances, together)
    diagonal = np.diagonal(covariances, axis1=2, axis2=3)[:, :, :p]
    mean, stddev = _mixed(days, spread)
    level, level_stddev = _mixed(levels, diagonal)
    if ahead is None:
        ahead = float(np.median(np.diff(series.times))) if n > 1 else 1.0
    return Pooled(
        names=series.names,
        mean=mean,
        stddev=stddev,
        level=level,
        level_stddev=level_stddev,
        walk=np.median(walk, axis=0),
        offset=np.median(offset, axis=0),
        walk_draws=walk,
        offset_draws=offset,
        jumps=tuple(sorted(jumps)),
        next_draws=_next(means[:, -1], covariances[:, -1], walk, offset, ahead, rng),
        ahead=ahead,
    )


def _mixed(means: Array, variances: Array) -> tuple[Array, Array]:
    """Return mean and standard deviation of a mixture of normals over its first axis."""
    return means.mean(axis=0), np.sqrt(variances.mean(axis=0) + means.var(axis=0))


def _smoothed(series: Series, jumps: set[int], walk: Array, offset: Array) -> tuple[Array, Array]:
    """Return means (h, n, 2p) and covariances (h, n, 2p, 2p) of levels and offsets."""
    n, p = series.mean.shape
    h = len(walk)
    see = np.concatenate([np.eye(p), np.eye(p)], axis=1)
    keep = np.zeros((2 * p, 2 * p))
    keep[:p, :p] = np.eye(p)
    # Where the level begins is told by the first days alone.
    m = np.zeros((h, 2 * p))
    m[:, :p] = series.mean[0]
    c = np.zeros((h, 2 * p, 2 * p))
    c[:, range(p), range(p)] = DIFFUSE**2
    before_m, before_c = np.empty((h, n, 2 * p)), np.empty((h, n, 2 * p, 2 * p))
    after_m, after_c = np.empty_like(before_m), np.empty_like(before_c)
    for t in range(n):
        if t:
            m, c = m @ keep, keep @ c @ keep
            noise = walk**2 * (series.times[t] - series.times[t - 1])
            c[:, range(p), range(p)] += noise + (JUMP**2 if t in jumps else 0.0)
        c[:, range(p, 2 * p), range(p, 2 * p)] = offset**2
        before_m[:, t], before_c[:, t] = m, c
        f = see @ c @ see.T + series.covariance[t]
        gain = np.linalg.solve(f, see @ c).swapaxes(1, 2)
        m = m + np.einsum('hab,hb->ha', gain, series.mean[t] - m @ see.T)
        c = c - gain @ see @ c
        c = 0.5 * (c + c.swapaxes(1, 2))
        after_m[:, t], after_c[:, t] = m, c
    for t in range(n - 2, -1, -1):
        back = np.linalg.solve(before_c[:, t + 1], keep @ after_c[:, t]).swapaxes(1, 2)
        after_m[:, t] += np.einsum('hab,hb->ha', back, after_m[:, t + 1] - before_m[:, t + 1])
        after_c[:, t] += back @ (after_c[:, t + 1] - before_c[:, t + 1]) @ back.swapaxes(1, 2)
    return after_m, after_c


def _next(
    m: Array, c: Array, walk: Array, offset: Array, ahead: float, rng: np.random.Generator
) -> Array:
    """Return draws of the parameters at the next test, SI units, (h * _EACH, p)."""
    h, p = walk.shape
    root = np.linalg.cholesky(c[:, :p, :p] + 1e-18 * np.eye(p))
    level = m[:, None, :p] + np.einsum('hab,hkb->hka', root, rng.standard_normal((h, _EACH, p)))
    scatter = np.sqrt(walk**2 * ahead + offset**2)[:, None]
    found = level + scatter * rng.standard_normal((h, _EACH, p))
    return np.asarray(np.exp(found.reshape(-1, p)))
