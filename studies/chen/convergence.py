"""Convergence as the paper tells it: its R-hat, and the evaluations that a step had taken."""

from __future__ import annotations

import numpy as np

from studies.chen.library import Array, Chains


def gelman_rubin(draws: Array) -> Array:
    """Gelman-Rubin diagnostic of each parameter from the last half of each chain.

    The paper's R-hat (Gelman and Rubin 1992; Vrugt 2016, Eq. 27), threshold 1.2: with N chains
    the variance between their means counts (N + 1)/N times.

    Args:
        draws: (steps, chains, p).

    Returns:
        (p,); nan where fewer than two draws or chains remain or nothing moves.
    """
    half = draws[len(draws) // 2 :]
    count, chains, parameters = half.shape
    if count < 2 or chains < 2:
        return np.full(parameters, np.nan)
    within = half.var(axis=0, ddof=1).mean(axis=0)
    between = half.mean(axis=0).var(axis=0, ddof=1)
    with np.errstate(divide='ignore', invalid='ignore'):
        share = between / within
    return np.asarray(np.sqrt((count - 1) / count + (chains + 1) / chains * share))


def evaluations_at(chains: Chains, step: int) -> int:
    """Likelihood evaluations made when the given step (from 0) was complete."""
    return chains.start_evaluations + (step + 1) * int(chains.draws.shape[1])
