"""Runs the compiled step over records: sub-steps, lanes, initial state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects import (
    assembly,
    coefficients,
    kernel,
    layout,
    linear_effects,
    linear_step,
)
from actuator_glue.model.effects.terms import machine
from actuator_glue.model.effects.terms.program import Program
from actuator_glue.records import Array, Hold, Record

# Sub-steps are at most this long: the error of one effect stays below 0.3 um on a 2 mm sweep.
MAX_STEP = 1.05e-3  # s
# ... and short against the fastest pole of Eq. (2), up to eight times shorter than MAX_STEP.
_MAX_POLE_STEP = 0.8
_MAX_REFINEMENT = 8
# Samples simulated at a time: their displacements stay in the second-level cache.
_CHUNK = 2048


def sample_steps(period: float, times: int = 1) -> int:
    """Return the usual number of sub-steps per sample.

    Args:
        period: of the samples [s].
        times: how many times shorter sub-steps must be than usual, see `turning`.
    """
    return max(1, int(np.ceil(period * times / MAX_STEP - 1e-9)))


def turning(program: Program, hold: Hold) -> int:
    """Return how many times shorter sub-steps are where a valve's error turns within them."""
    return program.shorter if hold == 'zoh' else 1


def refinement(values: Mapping[str, Array], stiffness: float, step: float) -> Array:
    """Return the factor 1, 2, 4 or 8 by which each parameter set needs shorter sub-steps, (m,)."""
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        natural = np.sqrt(values['alpha_1_beta_0'] / (values['alpha_2'] + stiffness))
        fastest = np.maximum(values['beta_1'], natural) * step / _MAX_POLE_STEP
        factor = 2.0 ** np.ceil(np.log2(fastest))
    return np.asarray(np.minimum(np.fmax(factor, 1.0), _MAX_REFINEMENT))  # NaN becomes 1


# Absurd parameters make NaN or infinite responses, seen by who asked for them, not warnings.
@np.errstate(all='ignore')
def tables(
    values: Mapping[str, Array],
    program: Program,
    stiffness: float,
    substeps: int,
    period: float,
    start: tuple[float, float],
) -> Array:
    """Return the kernel's tables at the first sample, shape (blocks, assembly.SIZE + registers).

    The last block is filled up by repeating the last parameter set.

    Args:
        values: parameters by name, each (m,), those of coefficients.NAMES that are not zero; also
            'origin', the time of the first sample since the test began [s], where it is not 0.
        program: effects written as expressions.
        stiffness: specimen stiffness k [N/m].
        substeps: sub-steps per sample.
        period: sample period [s].
        start: position [m] and velocity [m/s].
    """
    total = np.zeros(len(values['beta_1']))
    parameters = np.zeros(len(total), coefficients.KIND)
    for name, value in values.items():
        total += value
        if name in coefficients.NAMES:
            parameters[name] = value
    # A limit that is not a number must not pass for no limit: it makes the state not a number.
    one = np.where(np.isnan(total), np.nan, 1.0)
    blocks = -(-len(total) // layout.LANES)
    x, v = start[0] * one, start[1] * one
    step = period / substeps
    out = np.zeros((blocks, assembly.SIZE + program.rows * layout.LANES))
    coefficients.fill(parameters, stiffness, step, period, x, v, out)
    if program.acts(machine.COMMAND, machine.SENSOR):
        which = np.minimum(np.arange(blocks * layout.LANES), len(total) - 1)
        registers = program.start(values, which)
        registers[:, machine.STEP], registers[:, machine.K] = step, stiffness
        registers[:, machine.D_V_MIDDLE], registers[:, machine.D_V_END] = 1.0 / step, 1.5 / step
        # What went before a record that begins in motion is not known.
        registers[:, list(program.memory)] = 0.0 if start == (0.0, 0.0) else np.nan
        for block in registers:
            program.prepare(block)
        out[:, assembly.SIZE :] = registers.reshape(blocks, -1)
    return out


def blocks(
    values: Mapping[str, Array],
    on: NDArray[np.bool_],
    program: Program,
    record: Record,
    start: tuple[float, float],
    rate: int = 1,
    force: bool = False,
) -> Iterator[tuple[NDArray[np.intp], int, Array]]:
    """Simulate a record for every parameter set, some samples and sets at a time.

    Args:
        values: parameters of every compiled stage by name, each (m,).
        on: switches, (assembly.SWITCHES,).
        program: effects written as expressions.
        record: command, period, hold and known stiffness.
        start: position and velocity at the first sample.
        rate: how many times finer than usual the sub-steps are.
        force: whether the actuator force is wanted in place of the displacement.

    Yields:
        Which parameter sets (c,), the first sample, and displacement (n, c) [m] before sensor
        post-steps, or force [N]; the array is overwritten by the next block.
    """
    stiffness = record.known_stiffness()
    base = rate * sample_steps(record.period, turning(program, record.hold))
    factors = refinement(values, stiffness, record.period / base)
    # One sample before the record: at rest the command was zero, else it was held.
    before = record.command[:1] if start != (0.0, 0.0) else np.zeros(1)
    command = np.concatenate([before, record.command])
    out = np.empty((min(len(record), _CHUNK), layout.LANES))
    load = np.empty((len(out) if force else 0, layout.LANES))
    for factor in np.unique(factors):
        which = np.flatnonzero(factors == factor)
        substeps = base * int(factor)
        some = {name: value[which] for name, value in values.items()}
        members = (which[i : i + layout.LANES] for i in range(0, len(which), layout.LANES))
        split = tables(some, program, stiffness, substeps, record.period, start)
        for lanes, table in zip(members, split, strict=True):
            for begin in range(0, len(record), _CHUNK):
                part = out[: min(_CHUNK, len(record) - begin)]
                kernel.advance(
                    table,
                    on,
                    program.parts,
                    command,
                    -1,
                    begin,
                    substeps,
                    record.period,
                    record.hold == 'linear',
                    part,
                    load[: len(part)],
                )
                shown = load[: len(part)] if force else part
                yield lanes, begin, shown[:, : len(lanes)]


def exact_blocks(
    values: Mapping[str, Array],
    third: int,
    delayed: bool,
    record: Record,
    start: tuple[float, float],
    force: bool = False,
) -> Iterator[tuple[NDArray[np.intp], int, Array]]:
    """Simulate a record with linear effects only, as `blocks` does, but exactly and faster.

    `third` and `delayed` as `linear_step.advance` takes them.
    """
    linear = record.hold == 'linear'
    before = record.command[:1] if start != (0.0, 0.0) else np.zeros(1)
    command = np.concatenate([before, record.command])
    out = np.empty((min(len(record), _CHUNK), layout.LANES))
    load = np.empty((len(out) if force else 0, layout.LANES))
    split = linear_effects.tables(values, record.known_stiffness(), record.period, linear, start)
    count = len(values['beta_1'])
    for block, table in enumerate(split):
        lanes = np.arange(block * layout.LANES, min((block + 1) * layout.LANES, count))
        for begin in range(0, len(record), _CHUNK):
            part = out[: min(_CHUNK, len(record) - begin)]
            linear_step.advance(table, third, delayed, command, -1, begin, part, load[: len(part)])
            shown = load[: len(part)] if force else part
            yield lanes, begin, shown[:, : len(lanes)]


@njit(nogil=True)
def add_errors(displacement: Array, measured: Array, sums: Array) -> None:
    """Add sum e and sum e^2 of e = measured - displacement to `sums`, shape (2, c).

    Args:
        displacement: (n, c) [m].
        measured: (n,) [m].
        sums: (2, c), updated [m, m^2].
    """
    for i in range(displacement.shape[0]):
        for n in range(displacement.shape[1]):
            error = measured[i] - displacement[i, n]
            sums[0, n] += error
            sums[1, n] += error * error
