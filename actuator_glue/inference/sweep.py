"""Generations of all chains: one at a time, or many in compiled code with the same bits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference import generation
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
    z, x, log_jacobian, correction, label = generation.propose(
        now.z, uniforms, archive.capacity_rows, archive.size, around.lower, around.width,
        *around.tuning, s.pairs, s.unit_jump, s.jitter, s.noise,
    )  # fmt: skip
    values = evaluate(log_density, x)
    target = generation.temper(values, log_jacobian, z, *around.tempering)
    accepted, infinite = generation.accept(*now, z, x, values, target, correction, uniforms)
    if infinite >= 0:
        refuse_infinite(x[infinite])
    generation.tally(now.z, z, accepted, label, around.tuning.scale, counts)
    return Walk(z, x, values, target), accepted, label


class Path(NamedTuple):
    """Where the chains stood after each of g generations: z, x (g, n, p), log_density (g, n)."""

    z: Array
    x: Array
    log_density: Array


def many(
    uniforms: Array,
    now: Walk,
    archive: Archive,
    until_append: int,
    around: Around,
    density: Compiled | None,
    log_density: LogDensity,
    counts: Array,
) -> tuple[Walk, Archive, Path]:
    """Advance all chains by g generations; the bits are those of `one` g times.

    Compiled code goes to the end, or to a candidate of infinite density, which `one` refuses.

    Args:
        uniforms: (g, n, `moves.uniforms_per_chain`).
        now: the chains.
        archive: past states that the moves draw from; the chains enter it every
            `settings.thinning` generations.
        until_append: generations until they do so next; 0 for never.
        around: what else the moves depend on.
        density: compiled form of the log likelihood; None has every generation done by `one`.
        log_density: log likelihood (n,) of points (n, p).
        counts: what moves achieved is added here.

    Returns:
        The chains, the archive, and the way the chains took.
    """
    s, (n, d) = around.settings, now.z.shape
    count, every = len(uniforms), s.thinning if until_append else 0
    path = Path(np.empty((count, n, d)), np.empty((count, n, d)), np.empty((count, n)))
    if every and count >= until_append:
        archive = archive.with_room(n * (1 + (count - until_append) // every))
    done = 0
    while done < count:
        if density is not None:
            more, size, *parts = _advance(
                uniforms[done:], *now, archive.capacity_rows, archive.size, until_append - done,
                every, around.lower, around.width, around.tuning, s.pairs, s.unit_jump, s.jitter,
                s.noise, around.tempering, density, counts,
                path.z[done:], path.x[done:], path.log_density[done:],
            )  # fmt: skip
            now, archive = Walk(*parts), archive.grown(size)
            done += more
            if done == count:
                break
        now, _, _ = one(uniforms[done], now, archive, around, log_density, counts)
        path.z[done], path.x[done], path.log_density[done] = now.z, now.x, now.log_density
        done += 1
        if every and done >= until_append and (done - until_append) % every == 0:
            archive = archive.append(now.z)
    return now, archive, path


# Strict floating point, as numpy has it: see compiled.log_densities.
@njit(fastmath=False)
def _advance(  # type: ignore[no-untyped-def]
    uniforms, z, x, values, target, rows, size, until_append, every, lower, width, tuning,
    pairs, unit_jump, jitter, noise, tempering, density, counts, path_z, path_x, path_values,
):  # fmt: skip
    """Do generations; return how many, the archive's size, the chains."""
    done = 0
    while done < len(uniforms):
        new_z, new_x, log_jacobian, correction, label = generation.propose(
            z, uniforms[done], rows, size, lower, width, tuning.move_cdf, tuning.crossover_cdf,
            tuning.scale, tuning.centre, tuning.factor, pairs, unit_jump, jitter, noise,
        )  # fmt: skip
        new_values = np.empty(len(z))
        log_densities(density, new_x, log_jacobian, new_values)
        new_target = generation.temper(
            new_values, log_jacobian, new_z, tempering.power, tempering.centre, tempering.factor
        )
        accepted, infinite = generation.accept(
            z, x, values, target, new_z, new_x, new_values, new_target, correction, uniforms[done]
        )
        if infinite >= 0:
            break  # `one` refuses it
        generation.tally(z, new_z, accepted, label, tuning.scale, counts)
        z, x, values, target = new_z, new_x, new_values, new_target
        path_z[done], path_x[done], path_values[done] = z, x, values
        done += 1
        if every > 0 and done >= until_append and (done - until_append) % every == 0:
            rows[size : size + len(z)] = z
            size += len(z)
    return done, size, z, x, values, target
