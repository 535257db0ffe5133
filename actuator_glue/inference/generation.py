"""One generation of all chains in compiled pieces: propose, temper, accept, tally.

After the first the caller evaluates the likelihood of all candidates in one batch, so no function
is handed to compiled code. `sweep` puts the pieces together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from actuator_glue.inference.coordinates import physical
from actuator_glue.inference.moves import (
    INDEPENDENCE,
    PARALLEL,
    SNOOKER,
    U_ACCEPT,
    U_MOVE,
    independence,
    parallel,
    snooker,
)
from actuator_glue.inference.moves.draw import choose
from actuator_glue.jit import njit
from actuator_glue.records import Array


class Tempering(NamedTuple):
    """The target r^(1 - power) p^power between a reference r and the posterior p.

    Attributes:
        power: 1 is the posterior itself.
        centre: centre of the reference's Student t, (p,); empty for the prior as reference.
        factor: its Cholesky factor, (p, p).
    """

    power: float
    centre: Array
    factor: Array


UNTEMPERED = Tempering(1.0, np.empty(0), np.empty((0, 0)))


@njit
def propose(  # type: ignore[no-untyped-def]
    z,
    uniforms,
    rows,
    size,
    lower,
    width,
    move_cdf,
    crossover_cdf,
    scale,
    centre,
    factor,
    pairs,
    unit_jump,
    jitter,
    noise,
):
    """Return candidates of all chains.

    Returns candidate (n, p) in sampling coordinates, x (n, p) in physical units, log_jacobian
    (n,), correction (n,) = log Hastings correction, label (n, 2) = move and crossover class.
    """
    n, d = z.shape
    candidate = np.empty((n, d))
    x = np.empty((n, d))
    log_jacobian = np.empty(n)
    correction = np.empty(n)
    label = np.empty((n, 2), np.int64)
    indices = np.empty((3, max(2 * pairs, 3)), np.int64)
    residual = np.empty(d)
    for i in range(n):
        row = uniforms[i]
        move = choose(row[U_MOVE], move_cdf)
        label[i, 0] = move
        label[i, 1] = -1
        correction[i] = 0.0
        if move == PARALLEL:
            label[i, 1] = parallel.propose(
                z[i],
                row,
                rows,
                size,
                scale,
                crossover_cdf,
                pairs,
                unit_jump,
                jitter,
                noise,
                indices,
                candidate[i],
            )
        elif move == SNOOKER:
            correction[i] = snooker.propose(z[i], row, rows, size, scale, indices, candidate[i])
        elif move == INDEPENDENCE:
            correction[i] = independence.propose(z[i], row, centre, factor, residual, candidate[i])
        log_jacobian[i] = physical(candidate[i], lower, width, x[i])
    return candidate, x, log_jacobian, correction, label


# Strict floating point: the same bits whatever it is compiled into.
@njit(fastmath=False)
def temper(values, log_jacobian, z, power, centre, factor):  # type: ignore[no-untyped-def]
    """Return the log target (n,) of points z (n, p), docs/dream.md (D1) and (D6).

    Beyond the bounds (log_jacobian minus infinity) it is minus infinity, whatever the likelihood
    says there.
    """
    target = np.empty(len(values))
    reference = log_jacobian
    if power != 1.0 and centre.size > 0:
        reference = independence.log_density(z, centre, factor)
    for i in range(len(values)):
        if log_jacobian[i] == -np.inf:
            target[i] = -np.inf
            continue
        target[i] = values[i] + log_jacobian[i]
        if power != 1.0:
            target[i] = (1.0 - power) * reference[i] + power * target[i]
    return target


@njit
def accept(  # type: ignore[no-untyped-def]
    z, x, log_density, target, new_z, new_x, new_log_density, new_target, correction, uniforms
):
    """Metropolis-Hastings: overwrite the new_ arrays with the current state where rejected.

    A target that is not a number is rejected. Returns accepted (n,) bool, and the first chain
    whose candidate has a target of plus infinity, -1 where none has.
    """
    n = z.shape[0]
    accepted = np.empty(n, np.bool_)
    infinite = -1
    for i in range(n):
        if new_target[i] == np.inf and infinite < 0:
            infinite = i
        log_ratio = new_target[i] - target[i] + correction[i]
        accepted[i] = math.log1p(-uniforms[i, U_ACCEPT]) < log_ratio
        if not accepted[i]:
            new_z[i] = z[i]
            new_x[i] = x[i]
            new_log_density[i] = log_density[i]
            new_target[i] = target[i]
    return accepted, infinite


@njit
def tally(z, candidate, accepted, label, scale, counts):  # type: ignore[no-untyped-def]
    """Add uses, acceptances and normalised squared jumps to counts (moves + crossovers, 3).

    Rows 0-2 are the moves, the rest the crossover classes (Vrugt 2016, section 3.2.1).
    """
    for i in range(z.shape[0]):
        jump2 = 0.0
        if accepted[i]:
            for j in range(z.shape[1]):
                step = (candidate[i, j] - z[i, j]) / scale[j]
                jump2 += step * step
        for side in range(2):
            row = label[i, side] + 3 * side
            if row >= 3 * side:
                counts[row, 0] += 1.0
                counts[row, 1] += accepted[i]
                counts[row, 2] += jump2
