"""This project's sampler on problem R, on one core: `python -m benchmarks.sampler RESULT.json`."""

from __future__ import annotations

import json
import os
import statistics
import sys
import time
from pathlib import Path
from typing import Any

for _name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'):
    os.environ[_name] = '1'

# Imports come late (E402): BLAS reads the number of its threads when it is loaded.
import numpy as np  # noqa: E402 - after the threads are set

from actuator_glue.inference.convergence import rhat  # noqa: E402 - after the threads are set
from actuator_glue.inference.dream import Chains, SamplerSettings, sample  # noqa: E402 - after the threads are set
from actuator_glue.inference.likelihood import GlueLikelihood  # noqa: E402 - after the threads are set
from actuator_glue.model import problem_r  # noqa: E402 - after the threads are set
from actuator_glue.model.fast import FastErrors  # noqa: E402 - after the threads are set
from actuator_glue.model.parameters import bounds  # noqa: E402 - after the threads are set
from actuator_glue.records import Array  # noqa: E402 - after the threads are set

G = 256.0
# More chains share the cost of a call; fewer make R-hat fall sooner. Sustained runs take these.
MANY = SamplerSettings(chains=64)


def evaluations_to_rhat(chains: Chains, limit: float = 1.01) -> float:
    """Evaluations, start and burn-in included, at which R-hat first falls to the limit."""
    at = chains.burn + 20
    while at <= len(chains.draws):
        if rhat(chains.draws[chains.burn : at]).max() <= limit:
            return float(chains.evaluations_at(at - 1))
        at = int(at * 1.05) + 1
    return float('inf')


def evaluation(settings: SamplerSettings, evaluations: int = 300_000, repeats: int = 5) -> float:
    """Processor time of one evaluation of a run, the likelihood and all else included [us]."""
    density = GlueLikelihood(FastErrors(problem_r.records()), G)
    taken = []
    for seed in range(repeats):
        began = time.process_time()
        rng = np.random.default_rng(seed)
        sample(rng, density, *bounds(), evaluations=evaluations, settings=settings)
        taken.append(time.process_time() - began)
    return statistics.median(taken) / evaluations * 1e6


def run(repeats: int = 5, seeds: int = 20) -> dict[str, Any]:
    """Return effective draws per processor second and evaluation, evaluations to R-hat 1.01.

    Keys: `ess_per_second` of runs of a million evaluations from the prior with 64 chains, all of
    the start and burn-in included (median over repeats); `ess_per_second_default` the same with
    default settings; `ess_per_1000_evaluations` from a warm start with default settings, burn-in
    included; `evaluations_to_rhat_1p01` that nine of ten seeds keep, `..._median`, and the share
    of seeds within 20 000; `evaluation_us` with the likelihood, 8 to 64 chains; `first_call_s`
    with compilation or its cache.
    """
    began = time.perf_counter()
    density = GlueLikelihood(FastErrors(problem_r.records()), G)
    first = sample(np.random.default_rng(0), density, *bounds(), evaluations=40_000)
    first_call = time.perf_counter() - began

    def per_second(settings: SamplerSettings, seed: int) -> float:
        began = time.process_time()
        chains = sample(
            np.random.default_rng(seed),
            density,
            *bounds(),
            evaluations=1_000_000,
            settings=settings,
        )
        seconds = time.process_time() - began
        return float(chains.ess.min()) / seconds

    many = [per_second(MANY, seed) for seed in range(repeats)]
    default = [per_second(SamplerSettings(), seed) for seed in range(repeats)]
    warm = [
        sample(
            np.random.default_rng(seed),
            density,
            *bounds(),
            evaluations=60_000,
            archive=first.archive,
        )
        for seed in range(repeats)
    ]
    reached = [
        evaluations_to_rhat(
            sample(np.random.default_rng(seed), density, *bounds(), evaluations=40_000)
        )
        for seed in range(seeds)
    ]
    return {
        'ess_per_second': statistics.median(many),
        'ess_per_second_default': statistics.median(default),
        'ess_per_second_lowest': min(many),
        'evaluations_to_rhat_1p01': float(np.quantile(reached, 0.9, method='higher')),
        'evaluations_to_rhat_1p01_median': statistics.median(reached),
        'share_within_20000': float(np.mean(np.array(reached) <= 20_000)),
        'ess_per_1000_evaluations': statistics.median(
            1000.0 * c.ess.min() / c.evaluations for c in warm
        ),
        'evaluation_us': {str(n): evaluation(SamplerSettings(chains=n)) for n in (8, 20, 64)},
        'first_call_s': first_call,
        'setting': '64 chains sustained, 20 chains for the other figures; fast likelihood',
    }


def history(size: int = 2000) -> Array:
    """Posterior draws that peers may start from, (size, 4)."""
    density = GlueLikelihood(FastErrors(problem_r.records()), G)
    draws = sample(np.random.default_rng(9), density, *bounds(), evaluations=60_000).posterior()
    return np.asarray(draws[np.linspace(0, len(draws) - 1, size).astype(int)])


if __name__ == '__main__':
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    Path(sys.argv[1]).write_text(json.dumps(run()))
