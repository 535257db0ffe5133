"""What a term makes of its signal along a motion that is given, not simulated."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

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
    error = beta_1 * oil * v / into
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
    code, row = made.parts[program.PART[place]], _REGISTERS[SIGNAL[place]]
    count = len(motion[SIGNAL[place]])
    out = np.empty((count, LANES))
    for i in np.repeat(range(count), pieces):
        for symbol, trace in motion.items():
            g[_REGISTERS[symbol]] = trace[i]
        m.once(code, g)
        out[i] = g[row]
        if made.parts[m.KEEP]:
            g[row] = motion[SIGNAL[place]][i]
            m.once(made.parts[m.KEEP], g)
    return out
