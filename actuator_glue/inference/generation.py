"""One generation of all chains in compiled pieces: propose, temper, accept, tally.

After the first the caller evaluates the likelihood of all candidates in one batch, so no function
is handed to compiled code. `sweep` puts the pieces together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.adaptation import Tuning
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


class Room(NamedTuple):
    """Where the candidates of n chains go, so that a loop allocates nothing.

    Attributes:
        log_jacobian: of the candidates, (n,).
        correction: log Hastings correction, (n,).
        label: move and crossover class, (n, 2).
        reference: log density of the tempered target's reference at the candidates, (n,).
        log_uniform: what the log acceptance ratio must exceed, (n,).
        floor: log likelihood below which the candidate is rejected, (n,).
        accepted: whether the chain moves there, (n,).
        indices: scratch, (3, max(2 pairs, 3)).
        residual: scratch, (p,).
    """

    log_jacobian: Array
    correction: Array
    label: NDArray[np.int64]
    reference: Array
    log_uniform: Array
    floor: Array
    accepted: NDArray[np.bool_]
    indices: NDArray[np.int64]
    residual: Array


@njit
def room(chains: int, dimension: int, pairs: int) -> Room:
    """Return room for the candidates of so many chains."""
    return Room(
        np.empty(chains),
        np.empty(chains),
        np.empty((chains, 2), np.int64),
        np.empty(chains),
        np.empty(chains),
        np.empty(chains),
        np.empty(chains, np.bool_),
        np.empty((3, max(2 * pairs, 3)), np.int64),
        np.empty(dimension),
    )


@njit
def propose(
    z: Array,
    uniforms: Array,
    rows: Array,
    size: int,
    lower: Array,
    width: Array,
    tuning: Tuning,
    pairs: int,
    unit_jump: float,
    jitter: float,
    noise: float,
    candidate: Array,
    x: Array,
    room: Room,
) -> None:
    """Write a candidate of every chain, (n, p), x the same in physical units, and `room`."""
    for i in range(z.shape[0]):
        row = uniforms[i]
        move = choose(row[U_MOVE], tuning.move_cdf)
        room.label[i, 0] = move
        room.label[i, 1] = -1
        room.correction[i] = 0.0
        if move == PARALLEL:
            room.label[i, 1] = parallel.propose(
                z[i],
                row,
                rows,
                size,
                tuning.scale,
                tuning.crossover_cdf,
                pairs,
                unit_jump,
                jitter,
                noise,
                room.indices,
                candidate[i],
            )
        elif move == SNOOKER:
            room.correction[i] = snooker.propose(
                z[i], row, rows, size, tuning.scale, room.indices, candidate[i]
            )
        elif move == INDEPENDENCE:
            room.correction[i] = independence.propose(
                z[i], row, tuning.centre, tuning.factor, room.residual, candidate[i]
            )
        room.log_jacobian[i] = physical(candidate[i], lower, width, x[i])
        room.log_uniform[i] = math.log1p(-row[U_ACCEPT])


# Strict floating point: the same bits whatever it is compiled into.
@njit(fastmath=False)
def refer(
    z: Array, log_jacobian: Array, power: float, centre: Array, factor: Array, reference: Array
) -> None:
    """Write the reference's log density (n,) at points z (n, p), docs/dream.md (D6)."""
    for i in range(len(z)):
        reference[i] = log_jacobian[i]
    if power != 1.0 and centre.size > 0:
        reference[:] = independence.log_density(z, centre, factor)


@njit(fastmath=False)
def temper(
    values: Array, log_jacobian: Array, reference: Array, power: float, target: Array
) -> None:
    """Write the log target (n,) of points, docs/dream.md (D1) and (D6).

    Beyond the bounds (log_jacobian minus infinity) it is minus infinity, whatever the likelihood
    says there.
    """
    for i in range(len(values)):
        if log_jacobian[i] == -np.inf:
            target[i] = -np.inf
            continue
        target[i] = values[i] + log_jacobian[i]
        if power != 1.0:
            target[i] = (1.0 - power) * reference[i] + power * target[i]


@njit(fastmath=False)
def expect(target: Array, power: float, room: Room) -> None:
    """Write room.floor: what a candidate's log likelihood must exceed, given chains' targets."""
    for i in range(len(target)):
        least = target[i] + room.log_uniform[i] - room.correction[i]
        if power != 1.0:
            least = (least - (1.0 - power) * room.reference[i]) / power
        room.floor[i] = least - room.log_jacobian[i]


@njit
def accept(
    z: Array, x: Array, log_density: Array, target: Array, new_z: Array, new_x: Array,
    new_log_density: Array, new_target: Array, room: Room,
) -> int:  # fmt: skip
    """Metropolis-Hastings: overwrite the new_ arrays with the current state where rejected.

    A target that is not a number is rejected. Returns the first chain whose candidate has a
    target of plus infinity, -1 where none has; room.accepted tells who moved.
    """
    infinite = -1
    for i in range(z.shape[0]):
        if new_target[i] == np.inf and infinite < 0:
            infinite = i
        log_ratio = new_target[i] - target[i] + room.correction[i]
        room.accepted[i] = room.log_uniform[i] < log_ratio
        if not room.accepted[i]:
            for j in range(z.shape[1]):
                new_z[i, j] = z[i, j]
                new_x[i, j] = x[i, j]
            new_log_density[i] = log_density[i]
            new_target[i] = target[i]
    return infinite


@njit
def tally(z: Array, candidate: Array, room: Room, scale: Array, counts: Array) -> None:
    """Add uses, acceptances and normalised squared jumps to counts (moves + crossovers, 3).

    Rows 0-2 are the moves, the rest the crossover classes (Vrugt 2016, section 3.2.1).
    """
    for i in range(z.shape[0]):
        jump2 = 0.0
        if room.accepted[i]:
            for j in range(z.shape[1]):
                step = (candidate[i, j] - z[i, j]) / scale[j]
                jump2 += step * step
        for side in range(2):
            row = room.label[i, side] + 3 * side
            if row >= 3 * side:
                counts[row, 0] += 1.0
                counts[row, 1] += room.accepted[i]
                counts[row, 2] += jump2
