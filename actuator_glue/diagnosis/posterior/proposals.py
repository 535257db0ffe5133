"""First proposals of importance sampling: a Student t for every scale of the discrepancy.

With a linear response the posterior is one normal distribution for each of these scales, fifty
times as wide for the largest as for the least: one normal with its moments is nothing like it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import log_ndtr

from actuator_glue.diagnosis.posterior.discrepancy import ScaleMixture
from actuator_glue.diagnosis.posterior.identifiable import Straight, Working
from actuator_glue.diagnosis.posterior.likelihood import Optimum
from actuator_glue.inference.importance import StudentMixture, lower_factor
from actuator_glue.inference.transforms import Composed, Transform
from actuator_glue.inference.transforms.laplace import Laplace
from actuator_glue.inference.transforms.near_zero import NearZero
from actuator_glue.records import Array

_LEAKAGE = 3  # column of alpha_3, of which records under one stiffness may show none
_GRID = 200
_REACH = 6.0  # standard deviations
_FAR = 1e2  # standard deviations beyond a bound: what is left is nearly exponential
_LEAST = 1e-6  # of all draws
_NOTHING = -1e300  # logarithm of the mass of an optimum that diverges


def proposed(
    around: Working | Straight, optima: Sequence[Optimum]
) -> tuple[Transform, StudentMixture]:
    """Return the coordinates to sample in, and what to draw from in them.

    Args:
        around: coordinates in which the response is taken as linear about each optimum.
        optima: at least one.
    """
    parts = _together(optima, around)
    outer: Transform = around
    if isinstance(around, Straight) and around.least > 0.0:
        parts, bent = _near_zero(parts, around.least)
        outer = Composed(around, bent)
    kept = parts.weights > _LEAST
    parts = ScaleMixture(parts.weights[kept], parts.means[kept], parts.covariances[kept])
    (mean, covariance), free = parts.moments(), np.full(parts.means.shape[1], np.inf)
    normal = Laplace(mean, covariance, free)
    scale = np.linalg.pinv(normal.root)
    factors = [lower_factor((scale @ Laplace(mean, c, free).root).T) for c in parts.covariances]
    start = StudentMixture(parts.weights, (parts.means - mean) @ scale.T, np.array(factors))
    return Composed(outer, normal), start


def _together(optima: Sequence[Optimum], around: Working | Straight) -> ScaleMixture:
    """Return the normal distributions about all optima, weighted by their posterior mass."""
    masses = np.maximum([o.log_mass() for o in optima], _NOTHING)
    shares = np.exp(masses - np.logaddexp.reduce(masses))
    all_ = [_bounded(o.moves, around.widest) for o in optima]
    parts = ScaleMixture(
        np.concatenate([s * m.weights for s, m in zip(shares, all_, strict=True)]),
        np.concatenate([o.centre + m.means for o, m in zip(optima, all_, strict=True)]),
        np.concatenate([m.covariances for m in all_]),
    )
    return _cut(parts, *around.box)


def _cut(parts: ScaleMixture, lower: Array, upper: Array) -> ScaleMixture:
    """Give parts the moments that they have between bounds (p,): most of one may lie beyond.

    One coordinate after the other; those that go with it follow.
    """
    means, covariances = parts.means.copy(), parts.covariances.copy()
    for mean, covariance in zip(means, covariances, strict=True):
        for i, (low, high) in enumerate(zip(lower, upper, strict=True)):
            sd = np.sqrt(covariance[i, i])
            ends = float((low - mean[i]) / sd), float((mean[i] - high) / sd)
            end, side = max((ends[0], 1.0), (ends[1], -1.0))
            if end < -_REACH:
                continue
            distance, variance = _above(end)
            slope = covariance[:, i] / sd
            mean += slope * side * distance
            covariance += np.outer(slope, slope) * (variance - 1.0)
    return ScaleMixture(parts.weights, means, covariances)


def _above(end: float) -> tuple[float, float]:
    """Mean and variance of a standard normal variable that is above some end."""
    if end > _FAR:
        return end + 1.0 / end, 1.0 / end**2
    density = -0.5 * (end**2 + np.log(2.0 * np.pi))
    mean = float(np.exp(density - log_ndtr(-end)))
    return mean, 1.0 - mean * (mean - end)


def _bounded(moves: ScaleMixture, widest: Array) -> ScaleMixture:
    """Keep coordinates that no record determines unmoved, and no wider than is possible."""
    sd = np.sqrt(np.einsum('sii->si', moves.covariances))
    known = sd <= widest
    shrink = np.where(known, 1.0, widest / sd)
    covariances = moves.covariances * shrink[:, :, None] * shrink[:, None, :]
    return ScaleMixture(moves.weights, np.where(known, moves.means, 0.0), covariances)


def _near_zero(parts: ScaleMixture, least: float) -> tuple[ScaleMixture, NearZero]:
    """Bend the coordinate of alpha_3, from `least` on, where it may be next to zero.

    Each part becomes two normal distributions with the moments of the bent part: one where the
    records tell the coordinate from zero, one where they do not.
    """
    scale = float(np.sqrt(parts.moments()[1][_LEAKAGE, _LEAKAGE]))
    weights, means, covariances = [], [], []
    for weight, mean, covariance in zip(*parts, strict=True):
        m, sd = mean[_LEAKAGE], float(np.sqrt(covariance[_LEAKAGE, _LEAKAGE]))
        grid = np.geomspace(least, least + sd, _GRID), m + sd * np.linspace(-_REACH, _REACH, _GRID)
        s = np.sort(np.concatenate(grid))
        s = s[s >= least]
        t = s / scale + np.log(s / scale)
        # The prior's 1/s and ds/dt make 1 / (s + scale).
        log_mass = -0.5 * ((s - m) / sd) ** 2 - np.log(sd * (s + scale))
        mass = np.exp(log_mass - log_mass.max()) * np.gradient(t)
        slope = covariance[_LEAKAGE] / sd**2
        rest = covariance - sd**2 * np.outer(slope, slope)
        for some in (s < sd, s >= sd):
            total = float(mass[some].sum())
            if not total > 0.0:
                continue
            both, share = np.stack([s[some], t[some]]), mass[some] / total
            at = both @ share
            spread = np.cov(both, aweights=share, bias=True)
            own = mean + slope * (at[0] - m)
            own[_LEAKAGE] = at[1]
            found = rest + spread[0, 0] * np.outer(slope, slope)
            found[_LEAKAGE] = found[:, _LEAKAGE] = slope * spread[0, 1]
            found[_LEAKAGE, _LEAKAGE] = max(spread[1, 1], 1e-12)
            weights.append(np.log(max(weight, 1e-300)) + log_mass.max() + np.log(total))
            means.append(own)
            covariances.append(found)
    shares = np.exp(np.array(weights) - np.logaddexp.reduce(weights))
    bent = NearZero(_LEAKAGE, scale, parts.means.shape[1])
    return ScaleMixture(shares, np.array(means), np.array(covariances)), bent
