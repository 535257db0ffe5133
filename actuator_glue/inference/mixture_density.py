"""Mixture of normal densities: compiled evaluation, fit, draws and moments."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.records import Array

# Smallest standard deviation of a coordinate beside the draws' own: keeps a matrix invertible.
_FLOOR = 1e-6


class Mixture(NamedTuple):
    """Mixture of normal densities; without a component there is no prior beyond the box.

    Attributes:
        log_weights: ln of weight over (2 pi)^(p/2) |covariance|^(1/2), shape (K,).
        means: shape (K, p).
        whiten: inverse Cholesky factors of the covariances, shape (K, p, p), lower triangular.
    """

    log_weights: Array
    means: Array
    whiten: Array


NO_MIXTURE = Mixture(np.empty(0), np.empty((0, 0)), np.empty((0, 0, 0)))


# Strict floating point: the same bits wherever it is inlined.
@njit(fastmath=False)
def log_mixture(mixture: Mixture, z: Array) -> float:
    """Return the log density of coordinates z (p,)."""
    total, largest = 0.0, -math.inf
    for i in range(len(mixture.log_weights)):
        square = 0.0
        for a in range(z.size):
            part = 0.0
            for b in range(a + 1):
                part += mixture.whiten[i, a, b] * (z[b] - mixture.means[i, b])
            square += part * part
        term = mixture.log_weights[i] - 0.5 * square
        if term > largest:
            total = total * math.exp(largest - term) + 1.0
            largest = term
        else:
            total += math.exp(term - largest)
    return largest + math.log(total)


@njit(fastmath=False)
def log_mixtures(mixture: Mixture, z: Array) -> Array:
    """Return the log densities (m,) of coordinates (m, p)."""
    found = np.empty(len(z))
    for i in range(len(z)):
        found[i] = log_mixture(mixture, z[i])
    return found


def fitted(z: Array, components: int) -> Mixture:
    """Return the mixture of so many normals that fits coordinates (m, p) best."""
    scale = np.maximum(z.std(axis=0), 1e-300)
    middle = z.mean(axis=0)
    y = (z - middle) / scale
    weights, means = np.ones(1), np.zeros((1, z.shape[1]))
    spreads = np.cov(y.T, bias=True).reshape(1, z.shape[1], -1)
    if components > 1:
        best = _expectation_maximisation(y, components)
        weights, means, spreads = best.weights_, best.means_, best.covariances_
    spreads = spreads + _FLOOR**2 * np.eye(z.shape[1])
    return _mixture(weights, middle + means * scale, spreads * np.outer(scale, scale))


def components(z: Array, most: int) -> int:
    """Return how many normals describe coordinates (m, p) best, `most` at most (BIC)."""
    y = (z - z.mean(axis=0)) / np.maximum(z.std(axis=0), 1e-300)
    scores = [float(_expectation_maximisation(y, k).bic(y)) for k in range(1, most + 1)]
    return 1 + scores.index(min(scores))


def _expectation_maximisation(y: Array, components: int) -> Any:
    # Loads in a second: only where it is needed.
    from sklearn.mixture import GaussianMixture

    # Not k-means: its threads sum in any order, and a replay wants the same bits.
    start = 'random_from_data'
    return GaussianMixture(
        components, random_state=0, init_params=start, reg_covar=_FLOOR, n_init=2
    ).fit(y)


def _mixture(weights: Array, means: Array, spreads: Array) -> Mixture:
    """Return a mixture of weights (K,), means (K, p) and covariances (K, p, p)."""
    factors = np.linalg.cholesky(spreads)
    logs = np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
    return Mixture(
        np.log(weights) - logs - 0.5 * means.shape[1] * np.log(2.0 * np.pi),
        np.ascontiguousarray(means),
        np.ascontiguousarray(np.linalg.inv(factors)),
    )


def covariances(mixture: Mixture) -> Array:
    """Return the covariance of each component, (K, p, p)."""
    factors = np.linalg.inv(mixture.whiten)
    return np.asarray(factors @ factors.transpose(0, 2, 1))


def with_covariances(mixture: Mixture, spreads: Array) -> Mixture:
    """Return a mixture with other covariances (K, p, p)."""
    return _mixture(_weights(mixture), mixture.means, spreads)


def scaled(mixture: Mixture, factor: float) -> Mixture:
    """Return a mixture whose whole covariance is `factor` times as large."""
    middle = covariance(mixture)[0]
    means = middle + np.sqrt(factor) * (mixture.means - middle)
    return _mixture(_weights(mixture), means, factor * covariances(mixture))


def sampled(mixture: Mixture, count: int, rng: np.random.Generator) -> Array:
    """Return draws (count, p) of a mixture's coordinates."""
    weights = _weights(mixture)
    which = rng.choice(len(weights), size=count, p=weights)
    factors = np.linalg.inv(mixture.whiten)
    steps = rng.standard_normal((count, mixture.means.shape[1]))
    return np.asarray(mixture.means[which] + np.einsum('mab,mb->ma', factors[which], steps))


def covariance(mixture: Mixture) -> tuple[Array, Array]:
    """Return mean (p,) and covariance (p, p) of a mixture's coordinates."""
    weights = _weights(mixture)
    mean = weights @ mixture.means
    apart = mixture.means - mean
    within = np.einsum('k,kab->ab', weights, covariances(mixture))
    return mean, within + np.einsum('k,ka,kb->ab', weights, apart, apart)


def _weights(mixture: Mixture) -> Array:
    """Return the weights (K,) of the components."""
    volume = np.log(np.abs(np.diagonal(mixture.whiten, axis1=1, axis2=2))).sum(axis=1)
    p = mixture.means.shape[1]
    weights = np.exp(mixture.log_weights - volume + 0.5 * p * np.log(2.0 * np.pi))
    return np.asarray(weights / weights.sum())
