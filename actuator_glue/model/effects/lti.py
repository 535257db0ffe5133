"""Linear effects exactly: the loop as a linear system, its transition matrix per sample.

States: piston position x, flow over oil stiffness q, and where an effect needs them velocity v,
force over oil stiffness f, rate of the flow q', recorded displacement y:

    q' = dq, T dq' = -dq - beta_1 q + (n0/d2) (g u - x)        (T = 0: q' = -beta_1 q + ...)
    no mass:  d2 x' = d2 q - alpha_3 k x
    damping:  c v' = d2 q - (d2 + alpha_3 c) v - alpha_3 k x
    mass:     m v' = d2 f - k x - (c + m d) v,  d2 f' = d2 q - alpha_3 d2 f - alpha_2 v
    T_s y' = x - y

with d2 = k + alpha_2. A delay moves the command by whole samples and a fraction, at which a held
command changes and a linear one bends: both enter exactly, through the integral and the double
integral of the transition matrix (docs/effects.md, 'Linear effects').
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects import transition
from actuator_glue.model.effects.rows import LANES
from actuator_glue.model.effects.stages import held
from actuator_glue.records import Array

NAMES: Final = (
    'beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3', 'gain', 'delay', 'valve_lag', 'damping',
    'mass', 'mass_damping', 'sensor_lag',
)  # fmt: skip
STATES: Final = 6
# A table: transition matrix, three columns for three command samples, states, force, whole
# samples of delay, and scratch for the delayed command.
_PHI: Final = 0
_IN: Final = STATES * STATES * LANES
_STATE: Final = _IN + 3 * STATES * LANES
_FORCE: Final = _STATE + STATES * LANES
_WHOLE: Final = _FORCE + STATES * LANES
_TAPS: Final = _WHOLE + LANES
SIZE: Final = _TAPS + 3 * LANES
# States that effects add to x and q (Effect.exact): velocity, velocity and force, rate of the
# flow, recorded displacement.
VELOCITY: Final = (2,)
MASS: Final = (2, 3)
VALVE: Final = (4,)
SENSOR: Final = (5,)
# Which of them the step has: one, 3 for a mass, NONE, or ALL.
_MASS: Final = 3
NONE: Final = -2
ALL: Final = -1
# Time constants below this do not act: they would move the piston by less than 0.1 nm.
_NOTHING = 1e-9  # s
_NO_MASS = 1e-14  # s^2, mass over oil stiffness

_strict: Any = partial(njit, fastmath=False)


@_strict
def _system(t: Array, k: float, a: Array, b: Array, row: NDArray[np.int64], force: Array) -> None:
    """Fill the system a (6, 6), its input b (6,) and force row (6,) of parameters t, in NAMES.

    row (6,) is the state each place of the table holds; -1 where an effect needs none.
    """
    b1, n0, a2, a3, gain = t[0], t[1], t[2], t[3], t[4]
    lag, c, m, d, sensor = t[6], t[7], t[8], t[9], t[10]
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
    values: Array, k: float, period: float, linear: bool, start: tuple[float, float], tables: Array
) -> None:
    """Fill tables (blocks, SIZE) of parameter sets values (m, len(NAMES))."""
    a, b, force = np.empty((STATES, STATES)), np.empty(STATES), np.empty(STATES)
    row = np.empty(STATES, np.int64)
    phi = np.empty((STATES, STATES))
    first, second, late, later = (
        np.empty(STATES), np.empty(STATES), np.empty(STATES), np.empty(STATES)
    )  # fmt: skip
    small, initial = np.empty((STATES, STATES)), np.empty(STATES)
    into = np.empty((STATES, 3))
    for i in range(len(values)):
        w, n = tables[i // LANES], i % LANES
        t = values[i]
        oil = k + t[2]
        row[0], row[1] = 0, 1
        row[3] = 3 if t[8] > _NO_MASS * oil else -1
        row[2] = 2 if row[3] >= 0 or t[7] > _NOTHING * oil else -1
        row[4] = 4 if t[6] > _NOTHING else -1
        row[5] = 5 if t[10] > _NOTHING else -1
        _system(t, k, a, b, row, force)
        # States that do not act are left out of the matrix, not only zero: their place is empty.
        used = np.array([r for r in row if r >= 0])
        p = len(used)
        small_a, small_b, scale = np.empty((p, p)), np.empty(p), np.ones(p)
        natural = math.sqrt(abs(t[1]) / oil)
        for r in range(p):
            if used[r] == 1 or used[r] == 2:
                scale[r] = natural
            elif used[r] == 4:
                scale[r] = natural * natural
            small_b[r] = b[used[r]]
            for c in range(p):
                small_a[r, c] = a[used[r], used[c]]
        lag = t[5] / period if t[5] == t[5] else 0.0
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
        load = k * position + (t[7] + t[8] * t[9]) * velocity
        initial[1] = velocity + t[3] * load / oil
        initial[3], initial[4], initial[5] = load / oil, 0.0, position
        for r in range(p):
            at = used[r]
            for c in range(p):
                w[_PHI + (STATES * at + used[c]) * LANES + n] = phi[r, c]
            for c in range(3):
                w[_IN + (3 * at + c) * LANES + n] = into[r, c]
            w[_STATE + at * LANES + n] = initial[at]
            w[_FORCE + at * LANES + n] = force[at]
        if row[5] < 0:  # the transducer shows the piston
            for c in range(STATES):
                w[_PHI + (STATES * 5 + c) * LANES + n] = w[_PHI + c * LANES + n]
            for c in range(3):
                w[_IN + (15 + c) * LANES + n] = w[_IN + c * LANES + n]
            w[_STATE + 5 * LANES + n] = position
        w[_WHOLE + n] = whole


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
    _fill(rows, float(stiffness), float(period), linear, start, out)
    return out


@njit(inline='always')
def _row2(w: Array, r: int, n: int, s: int, t: int) -> Any:
    """Part of the next state r that comes from the states s and t."""
    into = w[_PHI + (STATES * r + s) * LANES + n] * w[_STATE + s * LANES + n]
    return into + w[_PHI + (STATES * r + t) * LANES + n] * w[_STATE + t * LANES + n]


@njit(inline='always')
def _row6(w: Array, r: int, n: int) -> Any:
    return _row2(w, r, n, 0, 1) + _row2(w, r, n, 2, 3) + _row2(w, r, n, 4, 5)


@njit(inline='always')
def _row4(w: Array, r: int, n: int) -> Any:
    return _row2(w, r, n, 0, 1) + _row2(w, r, n, 2, 3)


@njit(inline='always')
def _one(w: Array, r: int, n: int, s: int) -> Any:
    return w[_PHI + (STATES * r + s) * LANES + n] * w[_STATE + s * LANES + n]


@njit(inline='always')
def _in(w: Array, r: int, n: int, delayed: bool, u1: float, u2: float) -> Any:
    """Part of the next state r that comes from the command."""
    start = _IN + 3 * r * LANES + n
    if delayed:
        return w[start] * w[_TAPS + n] + (
            w[start + LANES] * w[_TAPS + LANES + n]
            + w[start + 2 * LANES] * w[_TAPS + 2 * LANES + n]
        )
    return w[start + LANES] * u1 + w[start + 2 * LANES] * u2


@njit
def _first_taps(w: Array, u: Array, at: int, whole: NDArray[np.int64]) -> None:
    """Fill the whole samples of delay, and the delayed command as before the step from `at`."""
    for n in range(LANES):
        whole[n] = int(w[_WHOLE + n])
        w[_TAPS + LANES + n] = held(u, at - 1 - whole[n])
        w[_TAPS + 2 * LANES + n] = held(u, at - whole[n])


@njit
def _shift(w: Array, u: Array, after: int, whole: NDArray[np.int64]) -> None:
    """Move the delayed command on by one sample, to the one that ends the step at `after`."""
    last = u.shape[0] - 1
    for n in range(LANES):
        # An index without sign: numba would add a test for one that counts from the end.
        new = u[np.uint64(min(max(after - whole[n], 0), last))]
        w[_TAPS + n], w[_TAPS + LANES + n] = w[_TAPS + LANES + n], w[_TAPS + 2 * LANES + n]
        w[_TAPS + 2 * LANES + n] = new


@njit(inline='always')
def _step3(w: Array, r: int, delayed: bool, u1: float, u2: float) -> None:
    """Move x, q and the state r, which they feel, on by one sample."""
    for n in range(LANES):
        x = _row2(w, 0, n, 0, 1) + _one(w, 0, n, r) + _in(w, 0, n, delayed, u1, u2)
        q = _row2(w, 1, n, 0, 1) + _one(w, 1, n, r) + _in(w, 1, n, delayed, u1, u2)
        s = _row2(w, r, n, 0, 1) + _one(w, r, n, r) + _in(w, r, n, delayed, u1, u2)
        w[_STATE + n], w[_STATE + LANES + n] = x, q
        w[_STATE + r * LANES + n] = s


@njit(nogil=True)
def advance(
    table: Array, third: int, delayed: bool, u: Array, offset: int, begin: int,
    displacement: Array, force: Array,
) -> None:  # fmt: skip
    """Write the recorded displacement at samples begin, begin+1, ... and carry the state on.

    Args:
        table: (SIZE,), read and updated; its states stand at sample begin - 1, or at sample 0
            where begin is 0.
        third: which state there is besides x and q, from `third`.
        delayed: whether parameter sets differ in their delay.
        u: command samples [m]; u[0] is sample `offset` of the stream.
        offset: stream index of u[0].
        begin: stream index of the first sample written.
        displacement: (n, LANES) output [m].
        force: (n, LANES) output, actuator force [N]; (0, LANES) where it is not wanted.
    """
    w = np.empty(SIZE)  # known to the compiler
    w[:] = table
    whole = np.empty(LANES, np.int64)
    if delayed:
        _first_taps(w, u, max(begin - 1, 0) - offset, whole)
    shown = _STATE + (5 * LANES if third in (5, ALL) else 0)
    for i in range(displacement.shape[0]):
        at = begin + i - 1  # the interval from sample `at` to the sample written now
        if at >= 0:
            u1, u2 = held(u, at - offset), held(u, at + 1 - offset)
            if delayed:
                _shift(w, u, at - offset + 1, whole)
            if third == NONE:
                for n in range(LANES):
                    x = _row2(w, 0, n, 0, 1) + _in(w, 0, n, delayed, u1, u2)
                    q = _row2(w, 1, n, 0, 1) + _in(w, 1, n, delayed, u1, u2)
                    w[_STATE + n], w[_STATE + LANES + n] = x, q
            elif third == 2:
                _step3(w, 2, delayed, u1, u2)
            elif third == _MASS:
                for n in range(LANES):
                    x = _row4(w, 0, n) + _in(w, 0, n, delayed, u1, u2)
                    q = _row4(w, 1, n) + _in(w, 1, n, delayed, u1, u2)
                    v = _row4(w, 2, n) + _in(w, 2, n, delayed, u1, u2)
                    f = _row4(w, 3, n) + _in(w, 3, n, delayed, u1, u2)
                    w[_STATE + n], w[_STATE + LANES + n] = x, q
                    w[_STATE + 2 * LANES + n], w[_STATE + 3 * LANES + n] = v, f
            elif third == 4:
                _step3(w, 4, delayed, u1, u2)
            elif third == 5:
                for n in range(LANES):  # nothing feels the transducer
                    x = _row2(w, 0, n, 0, 1) + _in(w, 0, n, delayed, u1, u2)
                    q = _row2(w, 1, n, 0, 1) + _in(w, 1, n, delayed, u1, u2)
                    s = _row2(w, 5, n, 0, 1) + _one(w, 5, n, 5) + _in(w, 5, n, delayed, u1, u2)
                    w[_STATE + n], w[_STATE + LANES + n] = x, q
                    w[_STATE + 5 * LANES + n] = s
            else:
                for n in range(LANES):
                    s0 = _row6(w, 0, n) + _in(w, 0, n, delayed, u1, u2)
                    s1 = _row6(w, 1, n) + _in(w, 1, n, delayed, u1, u2)
                    s2 = _row6(w, 2, n) + _in(w, 2, n, delayed, u1, u2)
                    s3 = _row6(w, 3, n) + _in(w, 3, n, delayed, u1, u2)
                    s4 = _row6(w, 4, n) + _in(w, 4, n, delayed, u1, u2)
                    s5 = _row6(w, 5, n) + _in(w, 5, n, delayed, u1, u2)
                    w[_STATE + n], w[_STATE + LANES + n] = s0, s1
                    w[_STATE + 2 * LANES + n], w[_STATE + 3 * LANES + n] = s2, s3
                    w[_STATE + 4 * LANES + n], w[_STATE + 5 * LANES + n] = s4, s5
        for n in range(LANES):
            displacement[i, n] = w[shown + n]
        if force.shape[0] > 0:
            for n in range(LANES):
                total = 0.0
                for r in range(STATES):
                    total += w[_FORCE + r * LANES + n] * w[_STATE + r * LANES + n]
                force[i, n] = total
    table[:] = w


def third(added: Iterable[tuple[int, ...] | None]) -> int:
    """Return which states effects add to x and q, given Effect.exact of each.

    One state's number; 3 for a mass, which brings velocity and force, and with them what damps
    the velocity; NONE for none, ALL for several.
    """
    states = {state for some in added for state in some or ()}
    if states == set(MASS):
        return _MASS
    return states.pop() if len(states) == 1 else ALL if states else NONE
