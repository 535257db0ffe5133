"""What a term makes of its signal along a motion that is given, not simulated."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model.effects.effect import Scale
from actuator_glue.model.effects.layout import LANES
from actuator_glue.model.effects.terms import machine as m
from actuator_glue.model.effects.terms import program
from actuator_glue.model.effects.terms.expression import SIGNAL
from actuator_glue.records import Array

_REGISTERS = {
    't': m.T,
    'x': m.X,
    'y': m.Y,
    'v': m.V,
    'u': m.U,
    'e': m.E,
    'q': m.Q,
    'f': m.F,
}
_PIECES = 8  # of a step in which something turns over: the last shows where that leads


def sine(scale: Scale, time: Array, period: float) -> dict[str, Array]:
    """Return the trace of everything that moves (n,), for a sine of the test's size [SI]."""
    beta_1, into, oil = scale.theta[0], max(float(scale.theta[1]), 1e-9), scale.oil
    turn = 2.0 * np.pi / period
    x = scale.stroke * np.sin(turn * time)
    v = scale.stroke * turn * np.cos(turn * time)
    # The spool has to be turned as well: dq/dt = alpha_1 beta_0 e - beta_1 q, without leakage.
    error = oil * (beta_1 * v - turn**2 * x) / into
    return {
        # A term of time may take the whole test to act, in which such a sine turns many times.
        't': scale.duration / time[-1] * time,
        'x': x,
        'y': x,
        'v': v,
        'u': x + error,
        'e': error,
        'q': oil * v,
        'f': scale.stiffness * x,
    }


def run(
    made: program.Program,
    place: str,
    values: Mapping[str, Array],
    motion: Mapping[str, Array],
    step: float,
    stiffness: float,
    theta: Array,
) -> Array:
    """Return the signal after a term, (n, LANES).

    Args:
        made: the term, compiled.
        place: where it acts.
        values: of its parameters by name, (LANES,) each.
        motion: trace of everything that it knows, (n,) each.
        step: time between two points of the traces [s].
        stiffness: of the specimen [N/m].
        theta: Eq. (2)'s parameters (4,).
    """
    g = made.start(values, np.arange(LANES))[0]
    pieces = _PIECES if made.parts[m.NEEDS] & m.NEEDS_CHANGE else 1
    g[m.STEP], g[m.K] = step / pieces, stiffness
    for j, row in enumerate((m.BETA_1, m.ALPHA_1_BETA_0, m.ALPHA_2, m.ALPHA_3)):
        g[row] = theta[j]
    made.prepare(g)
    signal, parts = SIGNAL[place], made.parts
    rows = np.array([_REGISTERS[symbol] for symbol in motion])
    out = np.empty((len(motion[signal]), LANES))
    codes = int(parts[program.PART[place]]), int(parts[m.KEEP])
    traces = np.array([np.asarray(trace, dtype=np.float64) for trace in motion.values()])
    _follow(g, *codes, list(motion).index(signal), rows, traces, pieces, out)
    return out


@njit(nogil=True)
def _follow(
    g: Array, code: int, keep: int, own: int, rows: Array, traces: Array, pieces: int, out: Array
) -> None:
    """Write what a part makes of its own signal, of traces (s, n) of registers (s,)."""
    for i in range(traces.shape[1]):
        for _ in range(pieces):
            for j in range(len(rows)):
                g[rows[j]] = traces[j, i]
            if code:
                m.execute(code, g, g)
            out[i] = g[rows[own]]
            if keep:
                g[rows[own]] = traces[own, i]
                m.execute(keep, g, g)
