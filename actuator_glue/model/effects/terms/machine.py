"""The machine that executes effects written as expressions, 32 parameter sets at a time.

Registers are the rows of a table (rows, LANES); an instruction is (operation, result, a, b, c,
memory). Every operation is a loop over lanes that the compiler turns into vector code. Strict
floating point: the same bits for a parameter set whatever its neighbours.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.records import Array

Code = NDArray[np.uint32]
# An instruction's numbers.
WIDTH: Final = 6
COPY, ADD, SUB, MUL, DIV, NEG, ABS, SIGN, SQRT, EXP, LOG, SIN, COS, TANH, ATAN, POW = range(16)
MIN, MAX, LESS, EQUAL, EDGE, SELECT, LAG, INTEGRAL, PLAY, LIMIT = range(16, 26)
# Fixed registers: what moves, what of it changes with the increment dx, what holds.
# NONE stands where an instruction has no operand.
NONE, T, U, E, Q, F, X, V, Y, D_Q, D_F, ORIGIN, STEP, D_V_MIDDLE, D_V_END = range(15)
BETA_1, ALPHA_1_BETA_0, ALPHA_2, ALPHA_3, K = range(15, 20)
FIXED: Final = 20
# The parts of a program. Its row 0 says where the instructions of each part but the last end, and
# how often the balance of forces is solved with them (TIMES); rows SIGNAL and SLOPE in which
# registers a part leaves its signal and d/d(dx); and SIGNAL, PREPARE which of `NEEDS` are read.
PREPARE, COMMAND, VALVE, FLOW, FORCE, SENSOR = range(6)
TIMES: Final = SENSOR
SIGNAL, SLOPE, FIRST = range(1, 4)
NEEDS_T, NEEDS_Q, NEEDS_F, NEEDS_V, NEEDS_V_END = 1, 2, 4, 8, 16

_strict: Any = partial(njit, fastmath=False)


# Of the Taylor series of exp(t) - 1 and sin(t), with what the first leaves out at 0.7 below
# rounding, and the second at a quarter turn.
_E2, _E3, _E4, _E5, _E6, _E7, _E8 = (1.0 / math.factorial(n) for n in range(2, 9))
_E9, _E10, _E11, _E12, _E13, _E14 = (1.0 / math.factorial(n) for n in range(9, 15))
_TURN: Final = 1.0 / (2.0 * math.pi)
_S3, _S5, _S7, _S9, _S11, _S13, _S15, _S17, _S19 = (
    (-1.0) ** (n // 2) / math.factorial(n) for n in range(3, 20, 2)
)


@_strict
def _expm1(x: Any, doublings: int) -> Any:
    """exp(x) - 1 from its series at x/2^doublings, which is at most 0.7 in size."""
    t = x * (1.0 / (1 << doublings))
    m = _E10 + t * (_E11 + t * (_E12 + t * (_E13 + t * _E14)))
    m = _E5 + t * (_E6 + t * (_E7 + t * (_E8 + t * (_E9 + t * m))))
    m = t * (1.0 + t * (_E2 + t * (_E3 + t * (_E4 + t * m))))
    for _ in range(doublings):
        m = m * (m + 2.0)
    return m


@_strict
def _exp(x: Any) -> Any:
    found = 1.0 + _expm1(min(abs(x), 709.0), 10)
    return (found if x > 0.0 else 1.0 / found) if x == x else x


@_strict
def _tanh(x: Any) -> Any:
    m = _expm1(2.0 * min(abs(x), 20.0), 6)
    size = m / (m + 2.0)
    return (size if x > 0.0 else -size) if x == x else x


@_strict
def _sine(turns: Any) -> Any:
    """sin(2 pi turns): Taylor series up to a quarter turn, to rounding."""
    part = turns - math.floor(turns + 0.5)
    folded = part if abs(part) <= 0.25 else (0.5 if part > 0.0 else -0.5) - part
    a = 2.0 * math.pi * folded
    z = a * a
    s = _S11 + z * (_S13 + z * (_S15 + z * (_S17 + z * _S19)))
    s = _S3 + z * (_S5 + z * (_S7 + z * (_S9 + z * s)))
    return a + a * z * s


# Not inlined where it is called: all of this is compiled once. One case an operation.
@_strict(forceinline=False, nogil=True)
def execute(g: Array, program: Code, first: int, last: int) -> None:  # noqa: C901
    """Execute instructions first..last of a program on registers g (rows, LANES)."""
    # As a constant it would have the short loops unrolled before they can become vector code.
    lanes = g.shape[1]
    for i in range(first, last):
        op, d, a = program[i, 0], program[i, 1], program[i, 2]
        b, c, s = program[i, 3], program[i, 4], program[i, 5]
        if op == MUL:
            for n in range(lanes):
                g[d, n] = g[a, n] * g[b, n]
        elif op == ADD:
            for n in range(lanes):
                g[d, n] = g[a, n] + g[b, n]
        elif op == SUB:
            for n in range(lanes):
                g[d, n] = g[a, n] - g[b, n]
        elif op == DIV:
            for n in range(lanes):
                g[d, n] = g[a, n] / g[b, n]
        elif op == COPY:
            for n in range(lanes):
                g[d, n] = g[a, n]
        elif op == NEG:
            for n in range(lanes):
                g[d, n] = -g[a, n]
        elif op == ABS:
            for n in range(lanes):
                g[d, n] = abs(g[a, n])
        elif op == SIGN:
            for n in range(lanes):
                value = g[a, n]
                g[d, n] = (1.0 if value > 0.0 else 0.0) - (1.0 if value < 0.0 else 0.0)
        elif op == SQRT:
            for n in range(lanes):
                g[d, n] = math.sqrt(g[a, n])
        elif op == EXP:
            for n in range(lanes):
                g[d, n] = _exp(g[a, n])
        elif op == TANH:
            for n in range(lanes):
                g[d, n] = _tanh(g[a, n])
        elif op == SIN:
            for n in range(lanes):
                g[d, n] = _sine(g[a, n] * _TURN)
        elif op == COS:
            for n in range(lanes):
                g[d, n] = _sine(g[a, n] * _TURN + 0.25)
        elif op == MIN:
            for n in range(lanes):
                left, right = g[a, n], g[b, n]
                g[d, n] = left if left < right or left != left else right
        elif op == MAX:
            for n in range(lanes):
                left, right = g[a, n], g[b, n]
                g[d, n] = left if left > right or left != left else right
        elif op == LESS:
            for n in range(lanes):
                g[d, n] = 1.0 if g[a, n] < g[b, n] else 0.0
        elif op == EQUAL:
            for n in range(lanes):
                g[d, n] = 1.0 if g[a, n] == g[b, n] else 0.0
        elif op == SELECT:
            for n in range(lanes):
                left, right = g[a, n], g[b, n]
                g[d, n] = left if g[c, n] != 0.0 else right
        else:
            _seldom(g, op, d, a, b, c, s)


@_strict(forceinline=False)
def _seldom(g: Array, op: int, d: int, a: int, b: int, c: int, s: int) -> None:
    """What remembers, and what is no vector code."""
    lanes = g.shape[1]
    for n in range(lanes):
        value, other, third, kept = g[a, n], g[b, n], g[c, n], g[s, n]
        if kept != kept:  # nothing is remembered yet
            kept = 0.0 if op == INTEGRAL else value
        if op == LAG:  # of a value held over the step: mean, and what it ends with
            g[d, n] = value + (kept - value) * third
            g[s, n] = value + (kept - value) * other
        elif op == INTEGRAL:
            g[d, n] = kept + 0.5 * other * value
            g[s, n] = kept + other * value
        elif op == PLAY:
            g[s, n] = min(max(kept, value - other), value + other)
            g[d, n] = g[s, n]
        elif op == LIMIT:
            g[s, n] = (
                value if abs(value - kept) <= other else kept + math.copysign(other, value - kept)
            )
            g[d, n] = g[s, n]
        elif op == EDGE:  # whether play drags
            g[d, n] = 1.0 if abs(value - other) >= third * (1.0 - 1e-9) else 0.0
        elif op == LOG:
            g[d, n] = math.log(value)
        elif op == ATAN:
            g[d, n] = math.atan(value)
        else:
            g[d, n] = value**other


@_strict(nogil=True)
def sense(g: Array, program: Code, time: Array, y: Array, out: Array) -> None:
    """Write what a sensor makes of displacements y (n, c) at times (n,), c at most LANES."""
    first, last = program[0, FORCE], len(program)
    for i in range(y.shape[0]):
        for n in range(y.shape[1]):
            g[Y, n] = y[i, n]
            g[T, n] = time[i]
        execute(g, program, first, last)
        for n in range(y.shape[1]):
            out[i, n] = g[program[SIGNAL, SENSOR], n]
