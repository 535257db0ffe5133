"""Steps of all chains: one at a time, or many in compiled code with the same bits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference import adaptation, compiled, metropolis
from actuator_glue.inference.archive import Archive
from actuator_glue.inference.compiled import Compiled, log_densities
from actuator_glue.inference.evaluate import LogDensity, evaluate, refuse_infinite
from actuator_glue.inference.metropolis import propose
from actuator_glue.inference.moves import MOVES
from actuator_glue.inference.moves.move import Move, ProposalContext, dispatch, workspace
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Strict floating point, as numpy has it: see compiled.log_densities.
_STRICT: dict[str, Any] = {'fastmath': False, 'nogil': True}


class ChainState(NamedTuple):
    """Where the chains stand.

    Attributes:
        z: sampling coordinates, (n, p).
        x: physical units, (n, p).
        log_density: log likelihood at x, (n,).
        log_target: log density of z that is sampled, (n,).
    """

    z: Array
    x: Array
    log_density: Array
    log_target: Array


class Kernels(NamedTuple):
    """Compiled code that knows a set of moves: candidates of all chains, and whole steps."""

    propose: Callable[..., None]
    advance: Callable[..., tuple[int, int, int]]


@lru_cache(maxsize=8)
def kernels(moves: tuple[Move, ...]) -> Kernels:
    """Return the compiled code for moves; only that of the first of `MOVES` is kept in files."""
    if moves and moves == MOVES[: len(moves)]:
        return Kernels(propose, _advance)
    proposing = _with_globals(propose, {}, _propose_by=dispatch(moves))
    return Kernels(proposing, _with_globals(_advance, _STRICT, propose=proposing))


def _with_globals(kernel: Any, options: dict[str, Any], **names: Any) -> Any:
    """Return a compiled function whose global names mean something else."""
    code = kernel.py_func
    twin = FunctionType(code.__code__, {**code.__globals__, **names}, code.__name__)
    return njit(cache=False, **options)(twin)


def one(
    uniforms: Array,
    now: ChainState,
    archive: Archive,
    context: ProposalContext,
    moves: tuple[Move, ...],
    log_density: LogDensity,
    counts: Array,
) -> tuple[ChainState, NDArray[np.bool_], NDArray[np.int64]]:
    """Advance all chains by one step.

    Args:
        uniforms: (n, `moves.uniforms_per_chain`).
        now: the chains.
        archive: past states that the moves draw from.
        context: what else they depend on.
        moves: the moves.
        log_density: log likelihood (n,) of points (n, p).
        counts: what moves achieved is added here.

    Returns:
        The chains, whether each has moved (n,), and the labels of the moves made (n, 2).
    """
    z, x, target = np.empty_like(now.z), np.empty_like(now.x), np.empty_like(now.log_target)
    space = workspace(len(z), z.shape[1], context.knobs.pairs)
    kernels(moves).propose(
        now.z, uniforms, archive.capacity_rows, archive.size, context, z, x, space
    )
    values = evaluate(log_density, x)
    metropolis.refer(z, space.log_jacobian, context.tempering, space.reference)
    metropolis.temper(values, space.log_jacobian, space.reference, context.tempering.power, target)
    infinite = metropolis.accept(*now, z, x, values, target, space)
    if infinite >= 0:
        refuse_infinite(x[infinite])
    metropolis.tally(now.z, z, space, context.tuning, counts)
    return ChainState(z, x, values, target), space.accepted, space.label


class Path(NamedTuple):
    """Where the chains stood after each of g steps: z, x (g, n, p), log_density (g, n)."""

    z: Array
    x: Array
    log_density: Array


class Learning(NamedTuple):
    """What the moves learn from besides archive and counts.

    Attributes:
        total: sum of each chain's log likelihoods since outliers were last looked for, (n,);
            changed in place.
        adapting: steps of adaptation to come.
        fitted: size of the archive when the moves were last fitted.
    """

    total: Array
    adapting: int
    fitted: int


NOTHING_LEARNT = Learning(np.empty(0), 0, 0)


def enter(
    now: ChainState, archive: Archive, context: ProposalContext, counts: Array, learning: Learning
) -> tuple[Archive, int]:
    """Put the chains into the archive and have the moves learn from it, in place.

    Returns the archive, and its size when the moves were last fitted.
    """
    archive = archive.append(now.z)
    fitted = adaptation.learn(
        *now,
        learning.total,
        archive.capacity_rows,
        archive.size,
        counts,
        context,
        learning.adapting > 0,
        learning.fitted,
    )
    return archive, int(fitted)


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """What many steps depend on besides the chains and the archive.

    Attributes:
        context: what the moves depend on; its tuning changes as they learn.
        moves: the moves.
        log_density: log likelihood (n,) of points (n, p).
        density: its compiled form; None has every step done by `one`.
        thinning: the chains enter the archive every so many steps; 0 for never.
    """

    context: ProposalContext
    moves: tuple[Move, ...]
    log_density: LogDensity
    density: Compiled | None
    thinning: int = 0


def many(
    uniforms: Array,
    now: ChainState,
    archive: Archive,
    course: Course,
    counts: Array,
    until_append: int = 0,
    learning: Learning = NOTHING_LEARNT,
) -> tuple[ChainState, Archive, int, Path]:
    """Advance all chains by g steps; the bits are those of `one` g times.

    Compiled code goes to the end, or to a candidate of infinite density, which `one` refuses.

    Args:
        uniforms: (g, n, `moves.uniforms_per_chain`).
        now: the chains.
        archive: past states that the moves draw from.
        course: what else the steps depend on.
        counts: what moves achieved is added here.
        until_append: steps until the chains next enter the archive.
        learning: what the moves learn from when they have.

    Returns:
        The chains, the archive, its size at the last fit of the moves, and the way the chains
        took.
    """
    context, every, (n, d) = course.context, course.thinning, now.z.shape
    count = len(uniforms)
    path = Path(np.empty((count, n, d)), np.empty((count, n, d)), np.empty((count, n)))
    if every and count >= until_append:
        archive = archive.with_room(n * (1 + (count - until_append) // every))
    target = np.empty((2, n))
    done = 0
    while done < count:
        if course.density is not None:
            target[0] = now.log_target
            more, size, fitted = kernels(course.moves).advance(
                uniforms[done:],
                *now[:3],
                archive.capacity_rows,
                archive.size,
                until_append - done,
                every,
                context,
                course.density,
                counts,
                path.z[done:],
                path.x[done:],
                path.log_density[done:],
                target,
                learning,
            )
            archive = archive.grown(size)
            learning = Learning(learning.total, learning.adapting - more, int(fitted))
            done += more
            if more:
                at = done - 1
                now = ChainState(path.z[at], path.x[at], path.log_density[at], target[more % 2])
            if done == count:
                break
        now, _, _ = one(
            uniforms[done], now, archive, context, course.moves, course.log_density, counts
        )
        done += 1
        if learning.adapting > 0:
            learning.total[:] += now.log_density
        fitted = learning.fitted
        if every and done >= until_append and (done - until_append) % every == 0:
            archive, fitted = enter(now, archive, context, counts, learning)
        learning = Learning(learning.total, learning.adapting - 1, fitted)
        path.z[done - 1], path.x[done - 1], path.log_density[done - 1] = now[:3]
    # Their own arrays: who keeps a state need not keep the way there.
    return ChainState(*(part.copy() for part in now)), archive, learning.fitted, path


@njit(**_STRICT)
def _advance(
    uniforms: Array,
    z: Array,
    x: Array,
    values: Array,
    rows: Array,
    size: int,
    until_append: int,
    every: int,
    context: ProposalContext,
    density: Compiled,
    counts: Array,
    path_z: Array,
    path_x: Array,
    path_values: Array,
    target: Array,
    learning: Learning,
) -> tuple[int, int, int]:
    """Do steps, in place; return how many, the archive's size, and that at the last fit.

    The target of the chains is read from target[0] and ends in target[count % 2].
    """
    done, power = 0, context.tempering.power
    total, fitted = learning.total, learning.fitted
    # Made here: to hand over many small arrays takes longer than a step.
    n, d = z.shape
    space, scratch = workspace(n, d, context.knobs.pairs), compiled.scratch(len(density.rows), n)
    while done < len(uniforms):
        new_z, new_x, new_values = path_z[done], path_x[done], path_values[done]
        here, there = target[done % 2], target[(done + 1) % 2]
        propose(z, uniforms[done], rows, size, context, new_z, new_x, space)
        metropolis.refer(new_z, space.log_jacobian, context.tempering, space.reference)
        metropolis.expect(here, power, space)
        log_densities(density, new_x, space.log_jacobian, space.floor, new_values, scratch)
        metropolis.temper(new_values, space.log_jacobian, space.reference, power, there)
        infinite = metropolis.accept(z, x, values, here, new_z, new_x, new_values, there, space)
        if infinite >= 0:
            break  # `one` refuses it
        metropolis.tally(z, new_z, space, context.tuning, counts)
        z, x, values = new_z, new_x, new_values
        done += 1
        burning = done <= learning.adapting
        if burning:
            for i in range(len(total)):
                total[i] += values[i]
        if every > 0 and done >= until_append and (done - until_append) % every == 0:
            rows[size : size + len(z)] = z
            size += len(z)
            fitted = adaptation.learn(
                z, x, values, there, total, rows, size, counts, context, burning, fitted
            )
    return done, size, fitted
