"""What every peer gets: the same posterior, two likelihoods, the same measures of draws."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from scipy import signal

from actuator_glue.inference.convergence import ess_bulk, rhat
from actuator_glue.inference.likelihood import GlueLikelihood
from actuator_glue.model import linear, reference_problem
from actuator_glue.model.fast import FastErrors
from actuator_glue.model.parameters import bounds
from actuator_glue.records import Array
from benchmarks.criterion import REPEATS, evaluations_to_rhat, middle

G = 256.0
LOWER, UPPER = bounds()

LogDensity = Callable[[Array], Array]


@dataclass(frozen=True)
class Sampler:
    """A peer's sampler.

    Attributes:
        run: (density, start (chains, 4) or None for the prior, history (m, 4) of posterior draws
            or None, evaluations, seed) -> draws (generations, chains, 4). density takes (m, 4).
        chains: number of chains or walkers.
        setting: the settings, for people.
        cold: evaluations of the run from the prior.
        warm: evaluations of the run from the posterior, with the fast likelihood.
    """

    run: Callable[[LogDensity, Array | None, Array | None, int, int], Array]
    chains: int
    setting: str
    cold: int
    warm: int


def lfilter_density() -> LogDensity:
    """The log likelihood as a user writes it: one scipy.signal.lfilter per record and theta."""
    records = reference_problem.records()

    def one(theta: Array) -> float:
        errors = []
        for record in records:
            num, den = linear.discretise(theta, record.known_stiffness(), record.period)
            errors.append(record.measured - signal.lfilter(num, den, record.command))
        return -G * float(np.log(np.concatenate(errors).var()))

    return inside(lambda theta: np.array([one(t) for t in theta]))


def fast_density() -> LogDensity:
    """The log likelihood of this project's fast path."""
    return inside(GlueLikelihood(FastErrors(reference_problem.records()), G))


def processor_seconds() -> float:
    """Processor time of this process and the children it has waited for [s].

    On one core this is the time that passes on a quiet machine, and a busy one does not spoil it.
    """
    return sum(os.times()[:4])


def inside(density: LogDensity) -> LogDensity:
    """Return the density with minus infinity outside the prior (m, 4) -> (m,)."""

    def log_density(theta: Array) -> Array:
        theta = np.atleast_2d(np.asarray(theta, dtype=np.float64))
        within = ((theta > LOWER) & (theta < UPPER)).all(axis=1)
        if within.all():
            return density(theta)
        values = np.full(len(theta), -np.inf)
        if within.any():
            values[within] = density(np.ascontiguousarray(theta[within]))
        return values

    return log_density


def measure(sampler: Sampler, history: Array) -> dict[str, Any]:
    """Run a peer `REPEATS` times from the prior and from the posterior, with both likelihoods.

    Figures are medians over the runs.
    """
    fast, filtered = fast_density(), lfilter_density()
    for density in (fast, filtered):
        density(history[:1])  # compiled before the clock starts
    reached = [
        evaluations_to_rhat(sampler.run(fast, None, None, sampler.cold, 1 + seed))
        for seed in range(REPEATS)
    ]
    result: dict[str, Any] = {
        'setting': sampler.setting,
        'chains': sampler.chains,
        'runs': REPEATS,
        'evaluations_to_rhat_1p01': middle(reached),
        'runs_converged': int(np.isfinite(reached).sum()),
        'evaluations_tried': sampler.cold,
    }
    for name, density, evaluations in (
        ('fast', fast, sampler.warm),
        ('lfilter', filtered, min(sampler.warm, 20_000)),
    ):
        runs = [_warm(sampler, density, history, evaluations, 1 + seed) for seed in range(REPEATS)]
        result[name] = {key: median(run[key] for run in runs) for key in runs[0]}
    # The better of the two, so that no peer is judged by a likelihood that does not suit it.
    for key in ('ess_per_second', 'ess_per_1000_evaluations'):
        result[key] = max(result[name][key] for name in ('fast', 'lfilter'))
    return result


def _warm(
    sampler: Sampler, density: LogDensity, history: Array, evaluations: int, seed: int
) -> dict[str, float]:
    """Run a peer from the posterior."""
    rng = np.random.default_rng(seed)
    start = history[rng.choice(len(history), sampler.chains, replace=False)]
    began = processor_seconds()
    draws = sampler.run(density, start, history, evaluations, seed)
    seconds = processor_seconds() - began
    ess = float(ess_bulk(draws).min())
    return {
        'evaluations': evaluations,
        'seconds': seconds,
        'ess': ess,
        'ess_per_second': ess / seconds,
        'ess_per_1000_evaluations': 1000.0 * ess / evaluations,
        'us_per_evaluation': seconds / evaluations * 1e6,
        'rhat': float(rhat(draws).max()),
    }
