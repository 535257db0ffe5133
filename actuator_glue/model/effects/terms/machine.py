"""Instructions and registers that effects written as expressions are programs of.

Registers are the rows of a table (rows, LANES); an instruction is (operation, result, a, b, c,
memory), all but the first of them registers. A negative register is a row of the compiled step's
own table: -rows.X is row X there. native.py makes code of the processor of a program, which works
on all lanes; here is how compiled functions call it.
"""

from __future__ import annotations

import ctypes
from typing import Any, Final, NamedTuple

from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.records import Array

COPY, ADD, SUB, MUL, DIV, NEG, ABS, SIGN, SQRT, EXP, LOG, SIN, COS, TANH, ATAN, POW = range(16)
MIN, MAX, LESS, SELECT, LAG, INTEGRAL, PLAY, LIMIT, RECALL = range(16, 25)
# Fixed registers: signals, their slopes along the increment dx, constants. A part leaves its
# signal, and d/d(dx) of it, where it has found them. NONE stands for no operand.
NONE, T, U, E, Q, F, X, V, Y, D_E, D_Q, D_F, ORIGIN, STEP, D_V_MIDDLE, D_V_END = range(16)
BETA_1, ALPHA_1_BETA_0, ALPHA_2, ALPHA_3, K = range(16, 21)
# By how much signals change over the step, beside the jump of a held command, and the share of the
# step behind that.
CHANGE_U, CHANGE_X, CHANGE_F, CHANGE_Q, JUMP, SHARE = range(21, 27)
FIXED: Final = 27
# The parts of a program, and what the compiled step is told (`Parts`): where the code of each is,
# 0 if it has none (KEEP: what forces remember of a step that is done); Newton steps at most of the
# balance of forces; which of `NEEDS` it reads.
PREPARE, COMMAND, VALVE, FLOW, FORCE, SENSOR, BALANCE, KEEP, TIMES, NEEDS = range(10)
NEEDS_T, NEEDS_U, NEEDS_E, NEEDS_Q, NEEDS_F, NEEDS_X, NEEDS_V, NEEDS_FLOW, NEEDS_CHANGE = (
    1 << i for i in range(9)
)
NEEDS_VALVE: Final = NEEDS_E | NEEDS_FLOW

Parts = NDArray[Any]


class Instruction(NamedTuple):
    """One operation on registers; what has a memory leaves two more behind its result."""

    operation: int
    result: int
    a: int
    b: int = NONE
    c: int = NONE
    memory: int = NONE


@intrinsic
def _compiled(_: Any, code: Any, g: Any, w: Any) -> Any:
    """Execute the code at an address, an integer, on registers g and the step's table w."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        tables = zip((g, w), arguments[1:], strict=True)
        data = [context.make_array(kind)(context, builder, table).data for kind, table in tables]
        kind = ir.FunctionType(ir.VoidType(), [pointer.type for pointer in data])
        builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), data)
        return context.get_dummy_value()

    return types.void(types.int64, g, w), generate


def _called(code: int, g: Array, w: Array) -> None:
    """As `_compiled`, where functions are not compiled (NUMBA_DISABLE_JIT)."""
    signature = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
    signature(int(code))(g.ctypes.data, w.ctypes.data)


execute = _called if config.DISABLE_JIT else _compiled


@njit
def once(code: int, g: Array) -> None:
    """Execute the code at an address, if any, on registers g (rows, LANES) alone."""
    if code:
        execute(code, g, g)


@njit(nogil=True)
def sense(g: Array, code: int, time: Array, y: Array, out: Array) -> None:
    """Write what a sensor makes of displacements y (n, c) at times (n,), c at most LANES."""
    for i in range(y.shape[0]):
        for n in range(y.shape[1]):
            g[Y, n] = y[i, n]
            g[T, n] = time[i]
        if code:
            execute(code, g, g)
        for n in range(y.shape[1]):
            out[i, n] = g[Y, n]
