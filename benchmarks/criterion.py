"""What this project's sampler and its peers are both measured by on problem R."""

from __future__ import annotations

from statistics import median

import numpy as np

from actuator_glue.inference.convergence import rhat
from actuator_glue.records import Array

# Runs of every sampler, ours and theirs; medians are told.
REPEATS = 3
# Reference posterior of problem R: a run counts as converged only if it also is there.
MEAN = np.array([133.65, 1.1005e9, 2.4927e5, 0.00592])
SD = np.array([1.044, 1.128e7, 2.048e3, 0.00583])


def evaluations_to_rhat(draws: Array, start: int = 0, limit: float = 1.01) -> float:
    """Evaluations at which the last half of the chains first has R-hat at or below a limit.

    Infinity where it never has, or where those draws are not near the reference posterior.

    Args:
        draws: all of a run from the prior, burn-in included, (generations, chains, 4).
        start: evaluations before the first generation.
        limit: of rank-normalised R-hat.
    """
    generations, chains, _ = draws.shape
    at = 50
    while at <= generations:
        half = draws[at // 2 : at]
        off = np.abs(half.mean(axis=(0, 1)) - MEAN) / SD
        if np.nanmax(rhat(half)) <= limit and off.max() < 0.5:
            return float(start + at * chains)
        at = int(at * 1.1) + 1
    return float('inf')


def middle(evaluations: list[float]) -> float | None:
    """Return the median over runs; None where that run has not converged."""
    found = median(evaluations)
    return found if np.isfinite(found) else None
