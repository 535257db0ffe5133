"""Draws of a nearly normal posterior by importance sampling, which says whether it succeeded.

Batches come from Student t's, each fitted to what the weights make of the batches before it;
a weight compares the posterior with the mixture of all (adaptive multiple importance sampling,
Cornuet et al. 2012). The largest weights are smoothed by a Pareto distribution (Vehtari et al.
2024), whose shape k tells whether they have a mean and a variance: from 0.5 on they have not, and
nothing is returned.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from actuator_glue.inference import student
from actuator_glue.inference.anneal import resample
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.records import Array

_BATCH = 192  # evaluations between two looks
_MOST = 6  # batches
# After so many batches what has not come as far as this share of the way is left to chains.
_LOOK, _SHARE = 3, 0.5
_PARETO = 0.5
_FEWEST = 5  # weights that a Pareto distribution is fitted to


class ImportanceSample(NamedTuple):
    """Equally weighted draws (m, p), one an evaluation; how many are effective, and k.

    Some of them are equal: fewer would lose what the weights know.
    """

    points: Array
    effective: float
    pareto_k: float


def sample(
    rng: np.random.Generator,
    log_density: LogDensity,
    dimension: int,
    effective: float,
    progress: Callable[[float], None] = lambda share: None,
) -> ImportanceSample | None:
    """Draw from a density that is nearly standard normal; None where it is too far from that.

    Args:
        rng: random numbers.
        log_density: of points (m, p), (m,), up to a constant; not finite where impossible.
        dimension: p.
        effective: how many effective draws are wanted.
        progress: called with the share done.
    """
    points, values = np.empty((0, dimension)), np.empty(0)
    centre: Array = np.zeros(dimension)
    factor: Array = np.eye(dimension)
    proposals: list[tuple[Array, Array]] = []
    for number in range(1, _MOST + 1):
        proposals.append((centre, factor))
        new = student.draw_all(rng.random((_BATCH, dimension + 4)), centre, factor)
        points = np.concatenate([points, new])
        values = np.concatenate([values, log_density(new)])
        densities = [
            student.log_density(points, c, f) - np.log(np.diag(f)).sum() for c, f in proposals
        ]
        weights, pareto_k = smoothed(values - np.logaddexp.reduce(densities, axis=0))
        count = 1.0 / float(weights @ weights)
        progress(min(1.0, count / effective))
        if count >= effective and pareto_k < _PARETO:
            with np.errstate(divide='ignore'):
                chosen = resample(rng, np.log(weights / weights.max()), len(points))
            return ImportanceSample(points[rng.permutation(chosen)], count, pareto_k)
        if number >= _LOOK and count < _SHARE * effective * number / _MOST:
            break
        centre = weights @ points
        off = points - centre
        # Few effective points do not know a covariance: it keeps to that of the proposal.
        known = count / (count + dimension + 1.0)
        covariance = known * (weights * off.T) @ off + (1.0 - known) * factor @ factor.T
        factor = np.asarray(np.linalg.cholesky(covariance))
    return None


def smoothed(log_weights: Array) -> tuple[Array, float]:
    """Pareto-smoothed weights (m,) of sum 1, and the shape k of their tail.

    Infinite where too few weights differ from nothing to tell. As Vehtari et al. (2024), and as
    arviz's `psislw`, whose import takes longer than a short diagnosis.
    """
    m = len(log_weights)
    finite = np.isfinite(log_weights)
    if finite.sum() < 2 * _FEWEST:
        return np.full(m, 1.0 / m), math.inf
    weights = np.exp(np.where(finite, log_weights, -np.inf) - log_weights[finite].max())
    order = np.argsort(weights)
    count = math.ceil(min(m / 5.0, 3.0 * math.sqrt(m)))
    cut = weights[order[-count - 1]]
    tail = order[-count:][weights[order[-count:]] > cut]
    shape = math.inf
    if len(tail) >= _FEWEST:
        shape, scale = _pareto(weights[tail] - cut)
        share = (np.arange(len(tail)) + 0.5) / len(tail)
        stretched = -np.log1p(-share)
        if abs(shape) > 1e-12:
            stretched = np.expm1(shape * stretched) / shape
        weights[tail] = np.minimum(cut + scale * stretched, 1.0)
    return weights / weights.sum(), shape


def _pareto(excess: Array) -> tuple[float, float]:
    """Shape and scale of a generalised Pareto distribution of ascending values (n,) above 0.

    Zhang & Stephens (2009), the shape drawn towards 0.5 by ten values' worth.
    """
    n = len(excess)
    count = 30 + int(math.sqrt(n))
    rates = (1.0 - np.sqrt(count / (np.arange(count) + 0.5))) / (
        3.0 * excess[int(n / 4 + 0.5) - 1]
    )
    rates += 1.0 / excess[-1]
    shapes = np.log1p(-rates[:, None] * excess).mean(axis=1)
    profile = n * (np.log(-rates / shapes) - shapes - 1.0)
    likely = np.exp(profile - np.logaddexp.reduce(profile))
    likely = np.where(likely >= 10.0 * np.finfo(float).eps, likely, 0.0)
    rate = float(likely @ rates / likely.sum())
    shape = float(np.log1p(-rate * excess).mean())
    return (n * shape + 10.0 * 0.5) / (n + 10.0), -shape / rate
