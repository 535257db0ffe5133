"""Linear effects exactly: the loop as a linear system, its transition matrix per sample.

States: piston position x, flow over oil stiffness q, and where an effect needs them velocity v,
force over oil stiffness f, rate of the flow q', recorded displacement y:

    q' = dq, T dq' = -dq - beta_1 q + (n0/d2) (g u - x)        (T = 0: q' = -beta_1 q + ...)
    no mass:  d2 x' = d2 q - alpha_3 k x
    damping:  c v' = d2 q - (d2 + alpha_3 c) v - alpha_3 k x
    mass:     m v' = d2 f - k x - (c + m d) v,  d2 f' = d2 q - alpha_3 d2 f - alpha_2 v
    T_s y' = x - y

with d2 = k + alpha_2. A delay, less a lead, moves the command by whole samples and a fraction, at
which a held command changes and a linear one bends: both enter exactly, through the integral and
the double integral of the transition matrix (docs/effects_method.md, 'Linear effects').
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects import catalogue, transition
from actuator_glue.model.effects.layout import LANES
from actuator_glue.model.effects.linear_step import (
    FORCE,
    INTO,
    PHI,
    SIZE,
    STATE,
    STATES,
    WHOLE,
)
from actuator_glue.model.parameters import NAMES as BASE
from actuator_glue.records import Array

# Parameters of the linear effects, those of Eq. (2) first.
NAMES: Final = (
    *BASE,
    *(p.name for e in catalogue.ENTRIES if e.exact is not None for p in e.parameters),
)
KIND: Final = np.dtype([(name, np.float64) for name in NAMES])
# Time constants below this do not act: they would move the piston by less than 0.1 nm.
_NOTHING = 1e-9  # s
_NO_MASS = 1e-14  # s^2, mass over oil stiffness

_strict: Any = partial(njit, fastmath=False)


@_strict
def system(p: Any, k: float, a: Array, b: Array, row: NDArray[np.int64], force: Array) -> None:
    """Fill the system a (6, 6), its input b (6,) and force row (6,) of parameters p.

    row (6,) is the state each place of the table holds; -1 where an effect needs none.
    """
    b1, n0, a2, a3, gain = p.beta_1, p.alpha_1_beta_0, p.alpha_2, p.alpha_3, p.gain
    lag, c, m, d, sensor = p.valve_lag, p.damping, p.mass, p.mass_damping, p.sensor_lag
    oil = k + a2
    drive = n0 / oil
    a[:], b[:], force[:] = 0.0, 0.0, 0.0
    if row[4] >= 0:
        a[1, 4] = 1.0
        a[4, 4], a[4, 1], a[4, 0] = -1.0 / lag, -b1 / lag, -drive / lag
        b[4] = gain * drive / lag
    else:
        a[1, 1], a[1, 0] = -b1, -drive
        b[1] = gain * drive
    force[0] = k
    if row[3] >= 0:
        a[0, 2] = 1.0
        a[2, 3], a[2, 0], a[2, 2] = oil / m, -k / m, -(c + m * d) / m
        a[3, 1], a[3, 3], a[3, 2] = 1.0, -a3, -a2 / oil
        force[0], force[3] = 0.0, oil
    elif row[2] >= 0:
        a[0, 2] = 1.0
        a[2, 1], a[2, 2], a[2, 0] = oil / c, -(oil + a3 * c) / c, -a3 * k / c
        force[2] = c
    else:
        a[0, 1], a[0, 0] = 1.0, -a3 * k / oil
    if row[5] >= 0:
        a[5, 0], a[5, 5] = 1.0 / sensor, -1.0 / sensor


@_strict
def _fill(
    values: Any, k: float, period: float, linear: bool, start: tuple[float, float], tables: Array
) -> None:
    """Fill tables (blocks, SIZE) of parameter sets values (m,) of KIND."""
    a, b, force = np.empty((STATES, STATES)), np.empty(STATES), np.empty(STATES)
    row = np.empty(STATES, np.int64)
    phi = np.empty((STATES, STATES))
    first, second, late, later = (
        np.empty(STATES),
        np.empty(STATES),
        np.empty(STATES),
        np.empty(STATES),
    )
    small, initial = np.empty((STATES, STATES)), np.empty(STATES)
    into = np.empty((STATES, 3))
    for i in range(len(values)):
        w, n = tables[i // LANES], i % LANES
        t = values[i]
        oil = k + t.alpha_2
        row[0], row[1] = 0, 1
        row[3] = 3 if t.mass > _NO_MASS * oil else -1
        row[2] = 2 if row[3] >= 0 or t.damping > _NOTHING * oil else -1
        row[4] = 4 if t.valve_lag > _NOTHING else -1
        row[5] = 5 if t.sensor_lag > _NOTHING else -1
        system(t, k, a, b, row, force)
        # States that do not act are left out of the matrix, not only zero: their place is empty.
        used = np.array([r for r in row if r >= 0])
        p = len(used)
        small_a, small_b, scale = np.empty((p, p)), np.empty(p), np.ones(p)
        natural = math.sqrt(abs(t.alpha_1_beta_0) / oil)
        for r in range(p):
            if used[r] == 1 or used[r] == 2:
                scale[r] = natural
            elif used[r] == 4:
                scale[r] = natural * natural
            small_b[r] = b[used[r]]
            for c in range(p):
                small_a[r, c] = a[used[r], used[c]]
        lag = (t.delay - t.lead) / period if t.delay == t.delay else 0.0
        whole = math.floor(lag)
        part = lag - whole
        transition.fill(small_a, small_b, scale, period, phi, first, second)
        transition.fill(small_a, small_b, scale, (1.0 - part) * period, small, late, later)
        for r in range(p):
            if linear:
                rise, bend = second[r] / period, later[r] / period
                into[r, 0] = part * first[r] - rise + bend
                into[r, 1] = (1.0 - part) * first[r] + rise - 2.0 * bend
                into[r, 2] = bend
            else:
                into[r, 0], into[r, 1], into[r, 2] = first[r] - late[r], late[r], 0.0
        position, velocity = start
        initial[0], initial[2] = position, velocity
        # As if it had gone on at this velocity.
        load = k * position + (t.damping + t.mass * t.mass_damping) * velocity
        initial[1] = velocity + t.alpha_3 * load / oil
        initial[3], initial[4], initial[5] = load / oil, 0.0, position
        for r in range(p):
            at = used[r]
            for c in range(p):
                w[PHI + (STATES * at + used[c]) * LANES + n] = phi[r, c]
            for c in range(3):
                w[INTO + (3 * at + c) * LANES + n] = into[r, c]
            w[STATE + at * LANES + n] = initial[at]
            w[FORCE + at * LANES + n] = force[at]
        if row[5] < 0:  # the transducer shows the piston
            for c in range(STATES):
                w[PHI + (STATES * 5 + c) * LANES + n] = w[PHI + c * LANES + n]
            for c in range(3):
                w[INTO + (15 + c) * LANES + n] = w[INTO + c * LANES + n]
            w[STATE + 5 * LANES + n] = position
        w[WHOLE + n] = whole


def tables(
    values: Mapping[str, Array],
    stiffness: float,
    period: float,
    linear: bool,
    start: tuple[float, float],
) -> Array:
    """Return tables (blocks, SIZE) at the first sample, the last block filled up with zeros.

    Args:
        values: parameters by name, each (m,), those of NAMES at least.
        stiffness: specimen stiffness k [N/m].
        period: sample period [s].
        linear: whether the command runs linearly between samples (else zero-order hold).
        start: position [m] and velocity [m/s].
    """
    rows = np.stack([np.asarray(values[name], dtype=np.float64) for name in NAMES], axis=1)
    # Parameters that are no numbers give answers that are none.
    rows[~np.isfinite(rows).all(axis=1)] = np.nan
    out = np.zeros((-(-len(rows) // LANES), SIZE))
    _fill(rows.view(KIND)[:, 0], float(stiffness), float(period), linear, start, out)
    return out
