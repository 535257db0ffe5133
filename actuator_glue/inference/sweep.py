"""Generations of all chains: one at a time, or many in compiled code with the same bits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference import adaptation, compiled, generation
from actuator_glue.inference.adaptation import Tuning
from actuator_glue.inference.archive import Archive
from actuator_glue.inference.compiled import Compiled, log_densities
from actuator_glue.inference.evaluate import LogDensity, evaluate, refuse_infinite
from actuator_glue.inference.settings import Settings
from actuator_glue.jit import njit
from actuator_glue.records import Array


class Walk(NamedTuple):
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


class Around(NamedTuple):
    """What a generation depends on besides the chains and the archive.

    Attributes:
        lower: lower bounds of the prior, (p,).
        width: its widths, (p,).
        tuning: proposal distributions.
        settings: settings of the sampler.
        tempering: see `generation.temper`; UNTEMPERED for the posterior itself.
    """

    lower: Array
    width: Array
    tuning: Tuning
    settings: Settings
    tempering: generation.Tempering = generation.UNTEMPERED


def one(
    uniforms: Array,
    now: Walk,
    archive: Archive,
    around: Around,
    log_density: LogDensity,
    counts: Array,
) -> tuple[Walk, NDArray[np.bool_], NDArray[np.int64]]:
    """Advance all chains by one generation.

    Args:
        uniforms: (n, `moves.uniforms_per_chain`).
        now: the chains.
        archive: past states that the moves draw from.
        around: what else they depend on.
        log_density: log likelihood (n,) of points (n, p).
        counts: what moves achieved is added here.

    Returns:
        The chains, whether each has moved (n,), and `generation.propose`'s labels (n, 2).
    """
    s = around.settings
    z, x, target = np.empty_like(now.z), np.empty_like(now.x), np.empty_like(now.log_target)
    room = generation.room(len(z), z.shape[1], s.pairs)
    generation.propose(
        now.z, uniforms, archive.capacity_rows, archive.size, around.lower, around.width,
        around.tuning, s.pairs, s.unit_jump, s.jitter, s.noise, z, x, room,
    )  # fmt: skip
    values = evaluate(log_density, x)
    generation.refer(z, room.log_jacobian, *around.tempering, room.reference)
    generation.temper(values, room.log_jacobian, room.reference, around.tempering.power, target)
    infinite = generation.accept(*now, z, x, values, target, room)
    if infinite >= 0:
        refuse_infinite(x[infinite])
    generation.tally(now.z, z, room, around.tuning.scale, counts)
    return Walk(z, x, values, target), room.accepted, room.label


class Path(NamedTuple):
    """Where the chains stood after each of g generations: z, x (g, n, p), log_density (g, n)."""

    z: Array
    x: Array
    log_density: Array


class Learning(NamedTuple):
    """What the moves learn from besides archive and counts.

    Attributes:
        total: sum of each chain's log likelihoods since outliers were last looked for, (n,);
            changed in place.
        burn_in: generations of burn-in to come.
        fitted: size of the archive when the moves were last fitted.
    """

    total: Array
    burn_in: int
    fitted: int


NOTHING_LEARNT = Learning(np.empty(0), 0, 0)


def enter(
    now: Walk, archive: Archive, around: Around, counts: Array, learning: Learning
) -> tuple[Archive, int]:
    """Put the chains into the archive and have the moves learn from it, in place.

    Returns the archive, and its size when the moves were last fitted.
    """
    s = around.settings
    archive = archive.append(now.z)
    fitted = adaptation.learn(
        *now, learning.total, archive.capacity_rows, archive.size, counts, s.independence,
        s.snooker, around.tuning, learning.burn_in > 0, learning.fitted,
    )  # fmt: skip
    return archive, int(fitted)


def many(
    uniforms: Array,
    now: Walk,
    archive: Archive,
    until_append: int,
    around: Around,
    density: Compiled | None,
    log_density: LogDensity,
    counts: Array,
    learning: Learning = NOTHING_LEARNT,
) -> tuple[Walk, Archive, int, Path]:
    """Advance all chains by g generations; the bits are those of `one` g times.

    Compiled code goes to the end, or to a candidate of infinite density, which `one` refuses.

    Args:
        uniforms: (g, n, `moves.uniforms_per_chain`).
        now: the chains.
        archive: past states that the moves draw from; the chains enter it every
            `settings.thinning` generations.
        until_append: generations until they do so next; 0 for never.
        around: what else the moves depend on; its tuning changes as they learn.
        density: compiled form of the log likelihood; None has every generation done by `one`.
        log_density: log likelihood (n,) of points (n, p).
        counts: what moves achieved is added here.
        learning: what they learn from when the chains have entered the archive.

    Returns:
        The chains, the archive, its size at the last fit of the moves, and the way the chains
        took.
    """
    s, (n, d) = around.settings, now.z.shape
    count, every = len(uniforms), s.thinning if until_append else 0
    path = Path(np.empty((count, n, d)), np.empty((count, n, d)), np.empty((count, n)))
    if every and count >= until_append:
        archive = archive.with_room(n * (1 + (count - until_append) // every))
    target = np.empty((2, n))
    done = 0
    while done < count:
        if density is not None:
            target[0] = now.log_target
            more, size, fitted = _advance(
                uniforms[done:], *now[:3], archive.capacity_rows, archive.size,
                until_append - done, every, around.lower, around.width, around.tuning, s.pairs,
                s.unit_jump, s.jitter, s.noise, around.tempering, density, counts, path.z[done:],
                path.x[done:], path.log_density[done:], target, learning, s.independence,
                s.snooker,
            )  # fmt: skip
            archive = archive.grown(size)
            learning = Learning(learning.total, learning.burn_in - more, int(fitted))
            done += more
            if more:
                at = done - 1
                now = Walk(path.z[at], path.x[at], path.log_density[at], target[more % 2])
            if done == count:
                break
        now, _, _ = one(uniforms[done], now, archive, around, log_density, counts)
        done += 1
        if learning.burn_in > 0:
            learning.total[:] += now.log_density
        fitted = learning.fitted
        if every and done >= until_append and (done - until_append) % every == 0:
            archive, fitted = enter(now, archive, around, counts, learning)
        learning = Learning(learning.total, learning.burn_in - 1, fitted)
        path.z[done - 1], path.x[done - 1], path.log_density[done - 1] = now[:3]
    # Their own arrays: who keeps a state need not keep the way there.
    return Walk(*(part.copy() for part in now)), archive, learning.fitted, path


# Strict floating point, as numpy has it: see compiled.log_densities.
@njit(fastmath=False, nogil=True)
def _advance(
    uniforms: Array, z: Array, x: Array, values: Array, rows: Array, size: int, until_append: int,
    every: int, lower: Array, width: Array, tuning: Tuning, pairs: int, unit_jump: float,
    jitter: float, noise: float, tempering: generation.Tempering, density: Compiled, counts: Array,
    path_z: Array, path_x: Array, path_values: Array, target: Array, learning: Learning,
    independence: float, snooker: float,
) -> tuple[int, int, int]:  # fmt: skip
    """Do generations, in place; return how many, the archive's size, and that at the last fit.

    The target of the chains is read from target[0] and ends in target[count % 2].
    """
    done, power = 0, tempering.power
    total, fitted = learning.total, learning.fitted
    # Made here: to hand over many small arrays takes longer than a generation.
    n, d = z.shape
    room, scratch = generation.room(n, d, pairs), compiled.scratch(len(density.rows), n)
    while done < len(uniforms):
        new_z, new_x, new_values = path_z[done], path_x[done], path_values[done]
        here, there = target[done % 2], target[(done + 1) % 2]
        generation.propose(
            z, uniforms[done], rows, size, lower, width, tuning, pairs, unit_jump, jitter, noise,
            new_z, new_x, room,
        )  # fmt: skip
        generation.refer(
            new_z, room.log_jacobian, power, tempering.centre, tempering.factor, room.reference
        )
        generation.expect(here, power, room)
        log_densities(density, new_x, room.log_jacobian, room.floor, new_values, scratch)
        generation.temper(new_values, room.log_jacobian, room.reference, power, there)
        infinite = generation.accept(z, x, values, here, new_z, new_x, new_values, there, room)
        if infinite >= 0:
            break  # `one` refuses it
        generation.tally(z, new_z, room, tuning.scale, counts)
        z, x, values = new_z, new_x, new_values
        done += 1
        burning = done <= learning.burn_in
        if burning:
            for i in range(len(total)):
                total[i] += values[i]
        if every > 0 and done >= until_append and (done - until_append) % every == 0:
            rows[size : size + len(z)] = z
            size += len(z)
            fitted = adaptation.learn(
                z, x, values, there, total, rows, size, counts, independence, snooker, tuning,
                burning, fitted,
            )  # fmt: skip
    return done, size, fitted
