"""Parallel-direction move: DREAM(ZS) of Vrugt (2016), section 3.3 and Algorithm 5."""

from __future__ import annotations

import math
from typing import Final

from actuator_glue.inference.moves.draw import choose, distinct
from actuator_glue.inference.moves.move import (
    NO_CLASS,
    U_FREE,
    Knobs,
    Move,
    Scratch,
    Tuning,
)
from actuator_glue.jit import njit
from actuator_glue.records import Array


@njit
def propose(
    z: Array,
    uniforms: Array,
    rows: Array,
    size: int,
    tuning: Tuning,
    knobs: Knobs,
    scratch: Scratch,
    candidate: Array,
) -> tuple[float, int]:
    """Write a candidate: a `Move.propose`, of no crossover class for unit jumps.

    candidate = z + (1 + lambda) gamma sum_k (a_k - b_k) + epsilon over the d* coordinates that
    cross over, gamma = 2.38 / sqrt(2 delta d*), lambda ~ U(-jitter, jitter), epsilon uniform and
    small. Symmetric: (a, b) and (b, a) are equally likely, and so are epsilon and -epsilon; the
    log Hastings correction is 0.
    """
    scale, crossover_cdf = tuning.scale, tuning.crossover_cdf
    pairs, indices = knobs.pairs, scratch.indices
    d = z.size
    at = U_FREE
    crossover = NO_CLASS
    delta = 1
    # A unit jump (gamma = 1) carries a chain from mode to mode: one pair, every coordinate.
    if uniforms[at] >= knobs.unit_jump:
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
            stretch = 1.0 + knobs.jitter * (2.0 * uniforms[at + d + j] - 1.0)
            small = knobs.noise * scale[j] * (2.0 * uniforms[at + 2 * d + j] - 1.0)
            candidate[j] += stretch * gamma * direction + small
    return 0.0, crossover


PARALLEL: Final = Move('parallel', propose, lambda dimension, pairs: 4 + 2 * pairs + 3 * dimension)
