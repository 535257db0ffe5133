"""Densities whose moments are known, for tests of the sampler."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from actuator_glue.records import Array


@dataclass(frozen=True)
class Target:
    """A density on a box, exact draws from it and its exact moments."""

    log_density: Callable[[Array], Array]
    lower: Array
    upper: Array
    draw: Callable[[np.random.Generator, int], Array]
    mean: Array
    sd: Array


def gaussian(covariance: Array, mean: Array, spread: float = 12.0) -> Target:
    """Gaussian well inside its box."""
    factor = np.linalg.cholesky(covariance)
    whiten = np.linalg.inv(factor).T
    sd = np.sqrt(np.diag(covariance))

    def log_density(x: Array) -> Array:
        return -0.5 * (((x - mean) @ whiten) ** 2).sum(axis=1)

    def draw(rng: np.random.Generator, size: int) -> Array:
        return mean + rng.standard_normal((size, len(mean))) @ factor.T

    return Target(log_density, mean - spread * sd, mean + 1.3 * spread * sd, draw, mean, sd)


def equicorrelated(d: int, rho: float = 0.5) -> Target:
    """Variances 1..d, correlation rho: Vrugt (2016), case study 2."""
    sd = np.sqrt(np.arange(1.0, d + 1.0))
    covariance = (rho * np.ones((d, d)) + (1.0 - rho) * np.eye(d)) * np.outer(sd, sd)
    return gaussian(covariance, np.zeros(d))


def scales() -> Target:
    """Four correlated parameters that differ by nine orders of magnitude, as Table 3's do."""
    sd = np.array([1.0, 1e7, 2e3, 1e-2])
    correlation = np.array(
        [[1.0, 0.74, 0.05, 0.0], [0.74, 1.0, 0.68, 0.0], [0.05, 0.68, 1.0, 0.0], [0, 0, 0, 1.0]]
    )
    return gaussian(correlation * np.outer(sd, sd), np.array([130.0, 1.1e9, 2.5e5, 0.5]))


def corner() -> Target:
    """Correlated Gaussian cut by its box at both lower bounds, where most of its mass lies."""
    covariance = np.array([[1.0, 0.8], [0.8, 1.0]])
    precision = np.linalg.inv(covariance)
    lower, upper = np.zeros(2), np.full(2, 8.0)

    def log_density(x: Array) -> Array:
        return -0.5 * np.einsum('ij,jk,ik->i', x, precision, x)

    def draw(rng: np.random.Generator, size: int) -> Array:
        parts: list[Array] = []
        while sum(map(len, parts)) < size:
            x = rng.multivariate_normal(np.zeros(2), covariance, size)
            parts.append(x[((x > lower) & (x < upper)).all(axis=1)])
        return np.concatenate(parts)[:size]

    # Positive orthant of a standard bivariate normal (Rosenbaum 1961); what lies beyond 8 standard
    # deviations is below 1e-14.
    share = 0.25 + np.arcsin(0.8) / (2.0 * np.pi)
    mean = (1.0 + 0.8) / (2.0 * np.sqrt(2.0 * np.pi) * share)
    second = 1.0 + 0.8 * np.sqrt(1.0 - 0.64) / (2.0 * np.pi * share)
    sd = np.sqrt(second - mean**2)
    return Target(log_density, lower, upper, draw, np.full(2, mean), np.full(2, sd))


def banana(d: int = 10, twist: float = 0.1) -> Target:
    """Twisted Gaussian of Haario, Saksman and Tamminen (1999): Vrugt (2016), case study 1 kind."""
    lower, upper = np.full(d, -15.0), np.full(d, 15.0)
    lower[:2], upper[:2] = (-80.0, -600.0), (80.0, 40.0)
    sd = np.ones(d)
    sd[:2] = 10.0, np.sqrt(1.0 + 2e4 * twist**2)

    def log_density(x: Array) -> Array:
        bent = x[:, 1] + twist * x[:, 0] ** 2 - 100.0 * twist
        return -0.5 * (x[:, 0] ** 2 / 100.0 + bent**2 + (x[:, 2:] ** 2).sum(axis=1))

    def draw(rng: np.random.Generator, size: int) -> Array:
        x = rng.standard_normal((size, d))
        x[:, 0] *= 10.0
        x[:, 1] -= twist * x[:, 0] ** 2 - 100.0 * twist
        return x

    return Target(log_density, lower, upper, draw, np.zeros(d), sd)


def two_modes(d: int = 10) -> Target:
    """One third around -5, two thirds around +5: Vrugt (2016), case study 3."""

    def log_density(x: Array) -> Array:
        low, high = ((x + 5.0) ** 2).sum(axis=1), ((x - 5.0) ** 2).sum(axis=1)
        return np.asarray(np.logaddexp(np.log(1 / 3) - 0.5 * low, np.log(2 / 3) - 0.5 * high))

    def draw(rng: np.random.Generator, size: int) -> Array:
        side = np.where(rng.random(size) < 1 / 3, -5.0, 5.0)
        return side[:, None] + rng.standard_normal((size, d))

    mean, sd = np.full(d, 5.0 / 3.0), np.full(d, np.sqrt(1.0 + 25.0 - 25.0 / 9.0))
    return Target(log_density, np.full(d, -20.0), np.full(d, 20.0), draw, mean, sd)


def t_values(estimates: Array, truth: Array) -> Array:
    """Student t of independent estimates (seeds, ...) of one truth (...)."""
    error = estimates.std(axis=0, ddof=1) / np.sqrt(len(estimates))
    return np.asarray((estimates.mean(axis=0) - truth) / error)


def t_limit(seeds: int, values: int, false_failure: float) -> float:
    """Limit of |t| that any of so many values exceeds by chance with the given probability."""
    return float(stats.t.isf(false_failure / values / 2.0, seeds - 1))
