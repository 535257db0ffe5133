"""Runs the compiled step over records: sub-steps, lanes, initial state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from actuator_glue.model.effects import coefficients, kernel
from actuator_glue.records import Array, Record

# Sub-steps are at most this long: the error of one effect stays below 0.3 um on a 2 mm sweep.
MAX_STEP = 1.05e-3  # s
# ... and short against the fastest pole of Eq. (2), up to eight times shorter than MAX_STEP.
_MAX_POLE_STEP = 0.8
_MAX_REFINEMENT = 8


def sample_steps(period: float) -> int:
    """Return the usual number of sub-steps per sample."""
    return max(1, int(np.ceil(period / MAX_STEP - 1e-9)))


def refinement(values: Mapping[str, Array], stiffness: float, step: float) -> Array:
    """Return the factor 1, 2, 4 or 8 by which each parameter set needs shorter sub-steps, (m,)."""
    with np.errstate(divide='ignore', invalid='ignore', over='ignore'):
        natural = np.sqrt(values['alpha_1_beta_0'] / (values['alpha_2'] + stiffness))
        fastest = np.maximum(values['beta_1'], natural) * step / _MAX_POLE_STEP
        factor = 2.0 ** np.ceil(np.log2(fastest))
    return np.asarray(np.clip(np.nan_to_num(factor, nan=1.0), 1.0, _MAX_REFINEMENT))


def initial(
    values: Mapping[str, Array], stiffness: float, step: float, start: tuple[float, float]
) -> Array:
    """Return the kernel's state at the first sample, shape (kernel.STATES, m).

    Args:
        values: parameters by name, each (m,).
        stiffness: specimen stiffness k [N/m].
        step: sub-step [s].
        start: position [m] and velocity [m/s].
    """
    x, v = start
    state = np.zeros((kernel.STATES, len(values['beta_1'])))
    state[[kernel.X, kernel.X_EXACT, kernel.X_TRAP, kernel.PLAY, kernel.SENSED]] = x
    state[[kernel.V, kernel.V_EXACT]] = v
    state[[kernel.DX, kernel.PLAY_DX]] = v * step
    state[[kernel.F, kernel.R]] = stiffness * x
    flow = (stiffness + values['alpha_2']) * v + values['alpha_3'] * stiffness * x
    state[[kernel.Q, kernel.Q_TRAP]] = flow
    return state


def padded(table: Array) -> Array:
    """Return the columns of a table filled up to whole lane blocks by repeating the last."""
    missing = -table.shape[1] % kernel.LANES
    return np.ascontiguousarray(np.pad(table, ((0, 0), (0, missing)), mode='edge'))


def blocks(
    values: Mapping[str, Array],
    on: NDArray[np.bool_],
    record: Record,
    start: tuple[float, float],
    rate: int,
) -> Iterator[tuple[NDArray[np.intp], Array]]:
    """Simulate a record for every parameter set, LANES at a time.

    Args:
        values: parameters of every compiled stage by name, each (m,).
        on: switches, (kernel.SWITCHES,).
        record: command, period, hold and known stiffness.
        start: position and velocity at the first sample.
        rate: how many times finer than usual the sub-steps are.

    Yields:
        Which parameter sets (c,) and their displacement (c, n) [m] before sensor post-steps.
    """
    stiffness = record.known_stiffness()
    base = rate * sample_steps(record.period)
    factors = refinement(values, stiffness, record.period / base)
    # One sample before the record: at rest the command was zero, else it was held.
    before = record.command[:1] if start != (0.0, 0.0) else np.zeros(1)
    command = np.concatenate([before, record.command])
    nothing = np.empty((0, kernel.LANES))
    out = np.empty((len(record), kernel.LANES))
    for factor in np.unique(factors):
        which = np.flatnonzero(factors == factor)
        substeps = base * int(factor)
        step = record.period / substeps
        some = {name: value[which] for name, value in values.items()}
        table = padded(coefficients.build(some, stiffness, step, record.period))
        state = padded(initial(some, stiffness, step, start))
        for first in range(0, len(which), kernel.LANES):
            lanes = slice(first, first + kernel.LANES)
            kernel.advance(
                np.ascontiguousarray(table[:, lanes]),
                np.ascontiguousarray(state[:, lanes]),
                on,
                command,
                -1,
                0,
                substeps,
                record.period,
                record.hold == 'linear',
                out,
                nothing,
            )
            members = which[lanes]
            yield members, np.ascontiguousarray(out[:, : len(members)].T)
