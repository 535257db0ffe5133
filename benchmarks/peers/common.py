"""What every peer gets: the same posterior, two likelihoods, the same measures of draws."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from actuator_glue.inference.convergence import ess_bulk, rhat
from actuator_glue.inference.likelihood import GlueLikelihood
from actuator_glue.model import linear, problem_r
from actuator_glue.model.fast import FastErrors
from actuator_glue.model.parameters import bounds
from actuator_glue.records import Array

G = 256.0
LOWER, UPPER = bounds()
# Reference posterior of problem R: a run counts as converged only if it also is there.
MEAN = np.array([133.65, 1.1005e9, 2.4927e5, 0.00592])
SD = np.array([1.044, 1.128e7, 2.048e3, 0.00583])

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
    records = problem_r.records()

    def one(theta: Array) -> float:
        errors = []
        for record in records:
            num, den = linear.discretise(theta, record.known_stiffness(), record.period)
            errors.append(record.measured - signal.lfilter(num, den, record.command))
        return -G * float(np.log(np.concatenate(errors).var()))

    return inside(lambda theta: np.array([one(t) for t in theta]))


def fast_density() -> LogDensity:
    """The log likelihood of this project's fast path."""
    return inside(GlueLikelihood(FastErrors(problem_r.records()), G))


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


def evaluations_to_rhat(draws: Array, limit: float = 1.01) -> int | None:
    """Evaluations at which the last half of the chains (g, c, 4) first has R-hat <= limit.

    None where it never has, or where the draws are not near the reference posterior.
    """
    generations, chains, _ = draws.shape
    at = 50
    while at <= generations:
        half = draws[at // 2 : at]
        off = np.abs(half.mean(axis=(0, 1)) - MEAN) / SD
        if np.nanmax(rhat(half)) <= limit and off.max() < 0.5:
            return at * chains
        at = int(at * 1.1) + 1
    return None


def measure(sampler: Sampler, history: Array) -> dict[str, Any]:
    """Run a peer from the prior and from the posterior, with both likelihoods."""
    rng = np.random.default_rng(1)
    start = history[rng.choice(len(history), sampler.chains, replace=False)]
    fast, filtered = fast_density(), lfilter_density()
    for density in (fast, filtered):
        density(start)  # compiled before the clock starts
    cold = sampler.run(fast, None, None, sampler.cold, 1)
    result: dict[str, Any] = {
        'setting': sampler.setting,
        'chains': sampler.chains,
        'evaluations_to_rhat_1p01': evaluations_to_rhat(cold),
        'evaluations_tried': sampler.cold,
    }
    for name, density, evaluations in (
        ('fast', fast, sampler.warm),
        ('lfilter', filtered, min(sampler.warm, 20_000)),
    ):
        began = processor_seconds()
        draws = sampler.run(density, start, history, evaluations, 2)
        seconds = processor_seconds() - began
        ess = float(ess_bulk(draws).min())
        result[name] = {
            'evaluations': evaluations,
            'seconds': seconds,
            'ess': ess,
            'ess_per_second': ess / seconds,
            'us_per_evaluation': seconds / evaluations * 1e6,
            'rhat': float(rhat(draws).max()),
        }
        result['ess_per_1000_evaluations'] = max(
            result.get('ess_per_1000_evaluations', 0.0), 1000.0 * ess / evaluations
        )
    # The better of the two, so that no peer is judged by a likelihood that does not suit it.
    result['ess_per_second'] = max(result[n]['ess_per_second'] for n in ('fast', 'lfilter'))
    return result
