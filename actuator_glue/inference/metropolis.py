"""One Metropolis step of all chains in compiled pieces: propose, temper, accept, tally.

After the first the caller evaluates the likelihood of all candidates in one batch, so no function
is handed to compiled code. `steps` puts the pieces together.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.inference import student
from actuator_glue.inference.moves import MOVES
from actuator_glue.inference.moves.draw import choose
from actuator_glue.inference.moves.move import (
    U_ACCEPT,
    U_MOVE,
    ProposalContext,
    Tempering,
    Tuning,
    Workspace,
    dispatch,
)
from actuator_glue.inference.transforms.log import physical
from actuator_glue.jit import njit
from actuator_glue.records import Array

_propose_by = dispatch(MOVES)


@njit
def propose(
    z: Array,
    uniforms: Array,
    rows: Array,
    size: int,
    context: ProposalContext,
    candidate: Array,
    x: Array,
    workspace: Workspace,
) -> None:
    """Write a candidate of every chain, (n, p), x the same in physical units, and `workspace`."""
    tuning, knobs, scratch = context.tuning, context.knobs, workspace.scratch
    for i in range(z.shape[0]):
        row = uniforms[i]
        move = choose(row[U_MOVE], tuning.move_cdf)
        correction, crossover = _propose_by(
            move, z[i], row, rows, size, tuning, knobs, scratch, candidate[i]
        )
        workspace.correction[i] = correction
        workspace.label[i, 0] = move
        workspace.label[i, 1] = crossover
        workspace.log_jacobian[i] = physical(candidate[i], context.lower, context.width, x[i])
        workspace.log_uniform[i] = math.log1p(-row[U_ACCEPT])


# Strict floating point: the same bits whatever it is compiled into.
@njit(fastmath=False)
def refer(z: Array, log_jacobian: Array, tempering: Tempering, reference: Array) -> None:
    """Write the reference's log density (n,) at points z (n, p), docs/dream.md (D6)."""
    for i in range(len(z)):
        reference[i] = log_jacobian[i]
    if tempering.power != 1.0 and tempering.centre.size > 0:
        reference[:] = student.log_density(z, tempering.centre, tempering.factor)


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
def expect(target: Array, power: float, workspace: Workspace) -> None:
    """Write workspace.floor: what candidates must exceed, given the chains' targets (n,)."""
    for i in range(len(target)):
        least = target[i] + workspace.log_uniform[i] - workspace.correction[i]
        if power != 1.0:
            least = (least - (1.0 - power) * workspace.reference[i]) / power
        workspace.floor[i] = least - workspace.log_jacobian[i]


@njit
def accept(
    z: Array,
    x: Array,
    log_density: Array,
    target: Array,
    new_z: Array,
    new_x: Array,
    new_log_density: Array,
    new_target: Array,
    workspace: Workspace,
) -> int:
    """Metropolis-Hastings: overwrite the new_ arrays with the current state where rejected.

    A target that is not a number is rejected. Returns the first chain whose candidate has a
    target of plus infinity, -1 where none has; workspace.accepted tells who moved.
    """
    infinite = -1
    for i in range(z.shape[0]):
        if new_target[i] == np.inf and infinite < 0:
            infinite = i
        log_ratio = new_target[i] - target[i] + workspace.correction[i]
        workspace.accepted[i] = workspace.log_uniform[i] < log_ratio
        if not workspace.accepted[i]:
            for j in range(z.shape[1]):
                new_z[i, j] = z[i, j]
                new_x[i, j] = x[i, j]
            new_log_density[i] = log_density[i]
            new_target[i] = target[i]
    return infinite


@njit
def tally(z: Array, candidate: Array, workspace: Workspace, tuning: Tuning, counts: Array) -> None:
    """Add uses, acceptances and normalised squared jumps to counts (M + n_CR, 3).

    The first M rows are the moves, the rest the crossover classes (Vrugt 2016, section 3.2.1).
    """
    for i in range(z.shape[0]):
        jump2 = 0.0
        if workspace.accepted[i]:
            for j in range(z.shape[1]):
                step = (candidate[i, j] - z[i, j]) / tuning.scale[j]
                jump2 += step * step
        for side in range(2):
            first = len(tuning.move_cdf) * side
            row = workspace.label[i, side] + first
            if row >= first:
                counts[row, 0] += 1.0
                counts[row, 1] += workspace.accepted[i]
                counts[row, 2] += jump2
