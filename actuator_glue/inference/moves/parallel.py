"""Parallel-direction move: DREAM(ZS) of Vrugt (2016), section 3.3 and Algorithm 5."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.moves import U_FREE
from actuator_glue.inference.moves.draw import choose, distinct
from actuator_glue.jit import njit
from actuator_glue.records import Array


@njit
def propose(
    z: Array,
    uniforms: Array,
    rows: Array,
    size: int,
    scale: Array,
    crossover_cdf: Array,
    pairs: int,
    unit_jump: float,
    jitter: float,
    noise: float,
    indices: NDArray[np.int64],
    candidate: Array,
) -> int:
    """Write a candidate, return the crossover class used (-1: unit jump, all coordinates).

    candidate = z + (1 + lambda) gamma sum_k (a_k - b_k) + epsilon over the d* coordinates that
    cross over, gamma = 2.38 / sqrt(2 delta d*), lambda ~ U(-jitter, jitter), epsilon uniform and
    small. Symmetric: (a, b) and (b, a) are equally likely, and so are epsilon and -epsilon; the
    log Hastings correction is 0.
    """
    d = z.size
    at = U_FREE
    crossover = -1
    delta = 1
    # A unit jump (gamma = 1) carries a chain from mode to mode: one pair, every coordinate.
    if uniforms[at] >= unit_jump:
        crossover = choose(uniforms[at + 1], crossover_cdf)
        delta = min(1 + int(uniforms[at + 2] * pairs), size // 2)
    lone = int(uniforms[at + 3] * d)
    at += 4
    distinct(uniforms, at, 2 * delta, size, indices)
    at += 2 * pairs

    rate = (crossover + 1.0) / crossover_cdf.size
    moved = 0
    for j in range(d):
        if crossover < 0 or uniforms[at + j] < rate:
            moved += 1
    gamma = 1.0 if crossover < 0 else 2.38 / math.sqrt(2.0 * delta * max(moved, 1))
    for j in range(d):
        candidate[j] = z[j]
        if crossover < 0 or uniforms[at + j] < rate or (moved == 0 and j == lone):
            direction = 0.0
            for k in range(delta):
                direction += rows[indices[0, 2 * k], j] - rows[indices[0, 2 * k + 1], j]
            stretch = 1.0 + jitter * (2.0 * uniforms[at + d + j] - 1.0)
            small = noise * scale[j] * (2.0 * uniforms[at + 2 * d + j] - 1.0)
            candidate[j] += stretch * gamma * direction + small
    return crossover
