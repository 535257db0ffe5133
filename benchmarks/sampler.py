"""This project's sampler on problem R, on one core: `python -m benchmarks.sampler RESULT.json`."""

from __future__ import annotations

import json
import os
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

for _name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'):
    os.environ[_name] = '1'

# Imports come late (E402): BLAS reads the number of its threads when it is loaded.
import numpy as np  # noqa: E402 - after the threads are set

from actuator_glue.inference import student  # noqa: E402 - after the threads are set
from actuator_glue.inference.dream import SamplerSettings, sample  # noqa: E402 - after the threads are set
from actuator_glue.inference.likelihood import GlueLikelihood  # noqa: E402 - after the threads are set
from actuator_glue.inference.moves import PUBLISHED  # noqa: E402 - after the threads are set
from actuator_glue.inference.transforms.log import Log  # noqa: E402 - after the threads are set
from actuator_glue.model import reference_problem  # noqa: E402 - after the threads are set
from actuator_glue.model.fast import FastErrors  # noqa: E402 - after the threads are set
from actuator_glue.model.parameters import bounds  # noqa: E402 - after the threads are set
from actuator_glue.records import Array  # noqa: E402 - after the threads are set
from benchmarks.criterion import REPEATS, evaluations_to_rhat, middle  # noqa: E402 - after the threads are set

G = 256.0
# More chains share the cost of a call; fewer make R-hat fall sooner. Sustained runs take these.
MANY = SamplerSettings(chains=64)


def evaluation(
    settings: SamplerSettings, evaluations: int = 300_000, repeats: int = REPEATS
) -> float:
    """Processor time of one evaluation of a run, the likelihood and all else included [us]."""
    density = GlueLikelihood(FastErrors(reference_problem.records()), G)
    taken = []
    for seed in range(repeats):
        began = time.process_time()
        rng = np.random.default_rng(seed)
        sample(rng, density, *bounds(), evaluations=evaluations, settings=settings)
        taken.append(time.process_time() - began)
    return statistics.median(taken) / evaluations * 1e6


def run() -> dict[str, Any]:
    """Return effective draws per processor second and evaluation, evaluations to R-hat 1.01.

    Each is the median of `REPEATS` runs, as of the peers. Keys: `ess_per_second` of runs of a
    million evaluations from the prior with 64 chains, all of the start and burn-in included;
    `ess_per_second_default` the same with default settings; `ess_per_1000_evaluations` from a warm
    start with default settings, burn-in included; `move_off` the same without the independence
    move, `importance` of importance sampling from the fitted Student t;
    `evaluations_to_rhat_1p01` and how many `runs_converged`; `evaluation_us` with the likelihood,
    8 to 64 chains; `first_call_s` with compilation or its cache.
    """
    began = time.perf_counter()
    density = GlueLikelihood(FastErrors(reference_problem.records()), G)
    first = sample(np.random.default_rng(0), density, *bounds(), evaluations=40_000)
    first_call = time.perf_counter() - began

    def per_second(settings: SamplerSettings, evaluations: int = 1_000_000) -> float:
        rates = []
        for seed in range(REPEATS):
            began, rng = time.process_time(), np.random.default_rng(seed)
            chains = sample(rng, density, *bounds(), evaluations=evaluations, settings=settings)
            rates.append(float(chains.ess.min()) / (time.process_time() - began))
        return statistics.median(rates)

    def per_evaluation(settings: SamplerSettings, evaluations: int) -> float:
        rates = []
        for seed in range(REPEATS):
            chains = sample(
                np.random.default_rng(seed),
                density,
                *bounds(),
                evaluations=evaluations,
                settings=settings,
                archive=first.archive,
            )
            rates.append(1000.0 * float(chains.ess.min()) / chains.evaluations)
        return statistics.median(rates)

    cold = [
        sample(np.random.default_rng(seed), density, *bounds(), evaluations=60_000)
        for seed in range(REPEATS)
    ]
    reached = [evaluations_to_rhat(c.draws, c.start_evaluations) for c in cold]
    off = SamplerSettings(moves=PUBLISHED)
    return {
        'runs': REPEATS,
        'ess_per_second': per_second(MANY),
        'ess_per_second_default': per_second(SamplerSettings()),
        'ess_per_1000_evaluations': per_evaluation(SamplerSettings(), 60_000),
        'evaluations_to_rhat_1p01': middle(reached),
        'runs_converged': int(np.isfinite(reached).sum()),
        'move_off': {
            'ess_per_second': per_second(replace(MANY, moves=PUBLISHED)),
            'ess_per_1000_evaluations': per_evaluation(off, 300_000),
        },
        'importance': importance(density, first.archive),
        'evaluation_us': {str(n): evaluation(SamplerSettings(chains=n)) for n in (8, 20, 64)},
        'first_call_s': first_call,
        'setting': '64 chains sustained, 20 chains for the other figures; fast likelihood',
    }


def importance(
    density: GlueLikelihood, points: Array, evaluations: int = 60_000
) -> dict[str, float]:
    """Importance sampling from the Student t fitted to posterior draws (m, 4), in the log's z.

    The effective draws are (sum w)^2 / sum w^2; what the fitted draws cost is not counted.
    """
    box = Log(*bounds())
    archive = box.forward(points)
    centre, factor = np.empty(4), np.empty((4, 4))
    student.fit(archive, centre, factor)
    shares, rates = [], []
    for seed in range(REPEATS):
        began = time.process_time()
        uniforms = np.random.default_rng(seed).random((evaluations, 4 + 4))
        z = student.draw_all(uniforms, centre, factor)
        x, log_jacobian = box.inverse(z)
        inside = np.isfinite(log_jacobian)
        log_weight = density(x[inside]) + log_jacobian[inside]
        log_weight -= student.log_density(z[inside], centre, factor)
        weight = np.exp(log_weight - log_weight.max())
        ess = float(weight.sum() ** 2 / (weight**2).sum())
        shares.append(1000.0 * ess / evaluations)
        rates.append(ess / (time.process_time() - began))
    return {
        'ess_per_second': statistics.median(rates),
        'ess_per_1000_evaluations': statistics.median(shares),
    }


def history(size: int = 2000) -> Array:
    """Posterior draws that peers may start from, (size, 4)."""
    density = GlueLikelihood(FastErrors(reference_problem.records()), G)
    draws = sample(np.random.default_rng(9), density, *bounds(), evaluations=60_000).posterior()
    return np.asarray(draws[np.linspace(0, len(draws) - 1, size).astype(int)])


if __name__ == '__main__':
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    Path(sys.argv[1]).write_text(json.dumps(run()))
