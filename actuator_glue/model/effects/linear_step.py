"""One step of the loop as a linear system: its table, and stepping through it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects.command import held
from actuator_glue.model.effects.layout import LANES
from actuator_glue.records import Array

STATES: Final = 6
# A table: transition matrix, three columns for three command samples, states, force, whole
# samples of delay, and scratch for the delayed command.
PHI: Final = 0
INTO: Final = STATES * STATES * LANES
STATE: Final = INTO + 3 * STATES * LANES
FORCE: Final = STATE + STATES * LANES
WHOLE: Final = FORCE + STATES * LANES
_TAPS: Final = WHOLE + LANES
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


@njit(inline='always')
def _row2(w: Array, r: int, n: int, s: int, t: int) -> Any:
    """Part of the next state r that comes from the states s and t."""
    into = w[PHI + (STATES * r + s) * LANES + n] * w[STATE + s * LANES + n]
    return into + w[PHI + (STATES * r + t) * LANES + n] * w[STATE + t * LANES + n]


@njit(inline='always')
def _row6(w: Array, r: int, n: int) -> Any:
    return _row2(w, r, n, 0, 1) + _row2(w, r, n, 2, 3) + _row2(w, r, n, 4, 5)


@njit(inline='always')
def _row4(w: Array, r: int, n: int) -> Any:
    return _row2(w, r, n, 0, 1) + _row2(w, r, n, 2, 3)


@njit(inline='always')
def _one(w: Array, r: int, n: int, s: int) -> Any:
    return w[PHI + (STATES * r + s) * LANES + n] * w[STATE + s * LANES + n]


@njit(inline='always')
def _in(w: Array, r: int, n: int, delayed: bool, u1: float, u2: float) -> Any:
    """Part of the next state r that comes from the command."""
    start = INTO + 3 * r * LANES + n
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
        whole[n] = int(w[WHOLE + n])
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
        w[STATE + n], w[STATE + LANES + n] = x, q
        w[STATE + r * LANES + n] = s


@njit(nogil=True)
def advance(
    table: Array,
    third: int,
    delayed: bool,
    u: Array,
    offset: int,
    begin: int,
    displacement: Array,
    force: Array,
) -> None:
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
    shown = STATE + (5 * LANES if third in (5, ALL) else 0)
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
                    w[STATE + n], w[STATE + LANES + n] = x, q
            elif third == 2:
                _step3(w, 2, delayed, u1, u2)
            elif third == _MASS:
                for n in range(LANES):
                    x = _row4(w, 0, n) + _in(w, 0, n, delayed, u1, u2)
                    q = _row4(w, 1, n) + _in(w, 1, n, delayed, u1, u2)
                    v = _row4(w, 2, n) + _in(w, 2, n, delayed, u1, u2)
                    f = _row4(w, 3, n) + _in(w, 3, n, delayed, u1, u2)
                    w[STATE + n], w[STATE + LANES + n] = x, q
                    w[STATE + 2 * LANES + n], w[STATE + 3 * LANES + n] = v, f
            elif third == 4:
                _step3(w, 4, delayed, u1, u2)
            elif third == 5:
                for n in range(LANES):  # nothing feels the transducer
                    x = _row2(w, 0, n, 0, 1) + _in(w, 0, n, delayed, u1, u2)
                    q = _row2(w, 1, n, 0, 1) + _in(w, 1, n, delayed, u1, u2)
                    s = _row2(w, 5, n, 0, 1) + _one(w, 5, n, 5) + _in(w, 5, n, delayed, u1, u2)
                    w[STATE + n], w[STATE + LANES + n] = x, q
                    w[STATE + 5 * LANES + n] = s
            else:
                for n in range(LANES):
                    s0 = _row6(w, 0, n) + _in(w, 0, n, delayed, u1, u2)
                    s1 = _row6(w, 1, n) + _in(w, 1, n, delayed, u1, u2)
                    s2 = _row6(w, 2, n) + _in(w, 2, n, delayed, u1, u2)
                    s3 = _row6(w, 3, n) + _in(w, 3, n, delayed, u1, u2)
                    s4 = _row6(w, 4, n) + _in(w, 4, n, delayed, u1, u2)
                    s5 = _row6(w, 5, n) + _in(w, 5, n, delayed, u1, u2)
                    w[STATE + n], w[STATE + LANES + n] = s0, s1
                    w[STATE + 2 * LANES + n], w[STATE + 3 * LANES + n] = s2, s3
                    w[STATE + 4 * LANES + n], w[STATE + 5 * LANES + n] = s4, s5
        for n in range(LANES):
            displacement[i, n] = w[shown + n]
        if force.shape[0] > 0:
            for n in range(LANES):
                total = 0.0
                for r in range(STATES):
                    total += w[FORCE + r * LANES + n] * w[STATE + r * LANES + n]
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
