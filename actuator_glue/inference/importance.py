"""Draws of a nearly known posterior by importance sampling, which says whether it succeeded.

Batches come from mixtures of Student t's, each fitted to the weighted batches before it (Cappe et
al. 2008); a weight compares the posterior with the mixture of all (adaptive multiple importance
sampling, Cornuet et al. 2012).

The largest weights are smoothed by a Pareto distribution, whose shape k tells whether means of
them are reliable: from 0.7 on, or less for few draws, they are not (Vehtari et al. 2024, section
3.2.4), and nothing is returned.

A tail that no draw has reached shows in no weight. With enough draws, half of each further batch
comes from around the point whose weight is largest, where draws are too few (incremental mixture
importance sampling, Raftery & Bao 2010), until their spreads no longer grow.
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
# Batches in which enough effective draws are found, and in which their spreads become steady.
_MOST, _LONGEST = 32, 40
# A run is given up where too few effective draws are expected by its last batch. They grow by
# leaps and with relapses as the mixture comes nearer, so that their growth is that of the largest
# number in so many batches over the largest before.
_LEAPS = 5
_PARETO = 0.7  # shape of the weights' tail
_LEAST = 1e-9  # spread of coordinates that have none
_EQUAL = 0.4  # of all draws are shared equally by a proposal's parts, whatever their weights
_WIDEST = 700.0  # logarithm of a ratio of weights
_NOTHING = 1e-300  # above the cut of a tail: its inverse, a few times over, is still a number
_FEWEST = 5  # weights that a Pareto distribution is fitted to
_PER_DIMENSION = 2  # effective points, at least, that a normal distribution is fitted to
_BISECTIONS = 12  # find the power of the weights that leaves so many
_NEAREST = 0.25  # of all points give the spread around the heaviest; _NEAR_PER_DIMENSION at least
_NEAR_PER_DIMENSION = 4
# Spreads are steady where none grew by so much over the least of so many looks before, and of a
# third of all: the more draws there are, the less a batch can change.
_GROWTH, _LOOKS = 0.05, 3


class ImportanceSample(NamedTuple):
    """Equally weighted draws (m, p), one per evaluation; how many are effective, and k.

    Some of them are repeated: fewer draws would lose information of the weights.
    """

    points: Array
    effective: float
    pareto_k: float


class StudentMixture(NamedTuple):
    """Mixture of Student t's: shares (k,) of sum 1, centres (k, p), Cholesky factors (k, p, p)."""

    shares: Array
    centres: Array
    factors: Array

    def draw(self, rng: np.random.Generator, count: int) -> Array:
        """Return draws (m, p), of each part as many as its share."""
        ends = np.round(count * np.cumsum(self.shares)).astype(int)
        uniforms = np.split(rng.random((count, self.centres.shape[1] + 4)), ends[:-1])
        parts = zip(uniforms, self.centres, self.factors, strict=True)
        return np.concatenate([student.draw_all(*part) for part in parts])

    def log_densities(self, points: Array) -> Array:
        """Log density of each part (k, m) at points (m, p), all less one constant."""
        rows = []
        for share, centre, factor in zip(*self, strict=True):
            size = np.log(share) - np.log(np.diag(factor)).sum()
            rows.append(student.log_density(points, centre, factor) + size)
        return np.array(rows)

    def refitted(self, points: Array, weights: Array) -> StudentMixture:
        """Return the mixture refitted to weighted points (m, p); parts with few of them stay."""
        of = self.log_densities(points)
        shares, centres, factors = [], [], []
        parts = np.exp(of - np.logaddexp.reduce(of, axis=0)) * weights
        for own, centre, factor in zip(parts, self.centres, self.factors, strict=True):
            total = own.sum()
            own = own / max(total, 1e-300)
            count = 1.0 / max(float(own @ own), 1e-300)
            known = count / (count + len(centre) + 1.0) if total > 0.0 else 0.0
            new = centre + known * (own @ points - centre)
            off = points - new
            rows = [np.sqrt(known * own)[:, None] * off, np.sqrt(1.0 - known) * factor.T]
            shares.append(total)
            centres.append(new)
            factors.append(lower_factor(np.concatenate(rows)))
        return StudentMixture(_shared(np.array(shares)), np.array(centres), np.array(factors))

    def beside(self, centre: Array, factor: Array) -> StudentMixture:
        """Return the mixture with one more part, from which half of all draws come."""
        return StudentMixture(
            np.append(0.5 * self.shares, 0.5),
            np.concatenate([self.centres, centre[None]]),
            np.concatenate([self.factors, factor[None]]),
        )


def lower_factor(rows: Array) -> Array:
    """Return the Cholesky factor (p, p) of rows.T @ rows (m, p), which may be singular."""
    factor: Array = np.linalg.qr(rows)[1].T
    size = np.diag(factor)
    factor = np.where(size < 0.0, -1.0, 1.0) * factor
    factor[np.diag_indices(len(factor))] = np.maximum(np.abs(size), _LEAST)
    return factor


def _shared(shares: Array) -> Array:
    """Return shares (k,) of which none is so small that nothing is drawn."""
    return np.asarray((1.0 - _EQUAL) * shares / shares.sum() + _EQUAL / len(shares))


def sample(
    rng: np.random.Generator,
    log_density: LogDensity,
    start: StudentMixture,
    effective: float,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[ImportanceSample | None, StudentMixture]:
    """Draw from a density near to a mixture of normal ones; None where it is too far from that.

    Also returns the last mixture, which is nearer to the density than the first.

    Args:
        rng: random numbers.
        log_density: of points (m, p), (m,), up to a constant; not finite where impossible.
        start: what is drawn from first.
        effective: how many effective draws are wanted.
        progress: called with the share done.
    """
    dimension = start.centres.shape[1]
    points, values = np.empty((0, dimension)), np.empty(0)
    fitted = start._replace(shares=_shared(start.shares))
    proposals = [fitted]
    counts: list[float] = []
    spreads: list[Array] = []
    for _ in range(_LONGEST):
        new = proposals[-1].draw(rng, _BATCH)
        points = np.concatenate([points, new])
        values = np.concatenate([values, log_density(new)])
        densities = np.concatenate([p.log_densities(points) for p in proposals])
        log_weights = values - np.logaddexp.reduce(densities, axis=0)
        weights, pareto_k = smoothed(log_weights)
        count = 1.0 / float(weights @ weights) if math.isfinite(pareto_k) else 1.0
        counts.append(count)  # 1: hardly any is possible
        enough = count >= effective
        progress(0.5 * min(1.0, count / effective) + 0.5 * min(1.0, len(spreads) / _LOOKS))
        if enough and pareto_k < min(_PARETO, 1.0 - 1.0 / math.log10(len(points))):
            spreads.append(np.sqrt(weights @ (points - weights @ points) ** 2))
            if _steady(spreads):
                with np.errstate(divide='ignore'):
                    chosen = resample(rng, np.log(weights / weights.max()), len(points))
                drawn = ImportanceSample(points[rng.permutation(chosen)], count, pareto_k)
                return drawn, fitted
        if not enough and (len(counts) >= _MOST or _most_expected(counts) < effective):
            break
        shared = _flattened(log_weights, weights, dimension)
        fitted = fitted.refitted(points, shared)
        around = (
            fitted.beside(*_around_heaviest(points, log_weights, weights)) if enough else fitted
        )
        proposals.append(around)
    return None, fitted


def _steady(spreads: list[Array]) -> bool:
    """Whether none of the spreads (p,) grew over those of the looks before."""
    looks = max(_LOOKS, len(spreads) // 3)
    if len(spreads) <= looks:
        return False
    before = np.min(spreads[-1 - looks : -1], axis=0)
    return bool(np.all(spreads[-1] < (1.0 + _GROWTH) * before))


def _around_heaviest(points: Array, log_weights: Array, weights: Array) -> tuple[Array, Array]:
    """Return the point (p,) of the largest weight, and the factor (p, p) of the spread near it.

    The nearest points give it, their weights half their own and half equal (Raftery & Bao 2010).
    """
    dimension = points.shape[1]
    heaviest = points[np.argmax(np.where(np.isfinite(log_weights), log_weights, -np.inf))]
    mean = weights @ points
    whole = lower_factor(np.sqrt(weights)[:, None] * (points - mean))
    off = points - heaviest
    distances = (np.linalg.solve(whole, off.T) ** 2).sum(axis=0)
    count = max(round(_NEAREST * len(points)), _NEAR_PER_DIMENSION * dimension)
    near = np.argsort(distances)[:count]
    shares = weights[near] + 1.0 / len(points)
    return heaviest, lower_factor(np.sqrt(shares / shares.sum())[:, None] * off[near])


def _most_expected(counts: list[float]) -> float:
    """Return how many effective draws are expected by the last batch, at most.

    They go on growing as they did, or, from a mixture that no longer changes, as all draws do.

    Args:
        counts: effective draws after each batch so far.
    """
    if len(counts) < 2 * _LEAPS:
        return math.inf
    last = max(counts[-_LEAPS:])
    growth = last / max(counts[:-_LEAPS])
    left = (_MOST - len(counts)) / _LEAPS
    return float(last * max(growth**left, _MOST / len(counts)))


def _flattened(log_weights: Array, weights: Array, dimension: int) -> Array:
    """Return weights (m,) of sum 1 that enough points share to fit a normal distribution to.

    Far from the density one point has all the weight: a power of the weights, as in annealing,
    shows the way.

    Args:
        log_weights: (m,), not finite where impossible.
        weights: the same, smoothed.
        dimension: of the points.
    """
    fewest = _PER_DIMENSION * (dimension + 1)
    possible = np.isfinite(log_weights)
    if 1.0 / float(weights @ weights) >= fewest or possible.sum() < 2 * fewest:
        return weights
    logs = np.where(possible, log_weights, -np.inf) - log_weights[possible].max()

    def flat(power: float) -> Array:
        found = np.exp(power * logs)
        return np.asarray(found / found.sum())

    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        shared = flat(middle)
        low, high = (middle, high) if 1.0 / (shared @ shared) >= fewest else (low, middle)
    return flat(low) if low > 0.0 else weights


def smoothed(log_weights: Array) -> tuple[Array, float]:
    """Pareto-smoothed weights (m,) of sum 1, and the shape k of their tail.

    k is infinite where too few weights differ from zero. As Vehtari et al. (2024), and as
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
    tail = order[-count:][weights[order[-count:]] - cut > _NOTHING]
    shape = math.inf
    if len(tail) >= _FEWEST:
        shape, scale = _pareto(weights[tail] - cut)
        share = (np.arange(len(tail)) + 0.5) / len(tail)
        stretched = -np.log1p(-share)
        if abs(shape) > 1e-12:
            # A tail hundreds of decades wide: its largest weights are limited to 1 below.
            stretched = np.expm1(np.minimum(shape * stretched, _WIDEST)) / shape
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
