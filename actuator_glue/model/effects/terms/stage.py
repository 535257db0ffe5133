"""Where the compiled step asks effects written as expressions."""

from __future__ import annotations

from typing import Any

from actuator_glue.jit import njit
from actuator_glue.model.effects import balance, stages
from actuator_glue.model.effects import rows as r
from actuator_glue.model.effects.terms import machine as m
from actuator_glue.records import Array


# The number of lanes is taken from the table: as a constant it would have short loops unrolled
# before they can become vector code.
@njit
def valve(w: Array, g: Array, program: m.Code, mean: float, rate: float, time: float) -> None:
    """Write the spool flow: command, control error and what moves in the middle of the step.

    The step is not known yet; all is taken as if the piston went on as before, and linear in
    what it does otherwise. `mean` and `time` as in `stages.valve` and `stages.flow`.
    """
    lanes, half, inverse = g.shape[1], 0.5 * rate, 1.0 / rate
    needs = program[m.SIGNAL, m.PREPARE]
    if needs & m.NEEDS_T:
        for n in range(lanes):
            g[m.T, n] = time + g[m.ORIGIN, n]
    if needs & m.NEEDS_V:
        for n in range(lanes):
            g[m.V, n] = half * w[r.DX + n]
    if needs & m.NEEDS_Q:
        for n in range(lanes):
            g[m.Q, n] = w[r.Q + n] + w[r.QD + n] * inverse
    if needs & m.NEEDS_F:
        for n in range(lanes):
            g[m.F, n] = w[r.F + n] + 0.5 * w[r.DF + n]
    for n in range(lanes):
        g[m.X, n] = w[r.X + n] + 0.5 * w[r.DX + n]
    for n in range(lanes):
        g[m.U, n] = w[r.GAIN + n] * (mean + w[r.IN_MEAN + n])
    m.execute(g, program, program[0, m.PREPARE], program[0, m.COMMAND])
    u = program[m.SIGNAL, m.COMMAND]
    for n in range(lanes):
        g[m.E, n] = g[u, n] + w[r.NULL + n] - g[m.X, n]
    m.execute(g, program, program[0, m.COMMAND], program[0, m.VALVE])
    e, slope = program[m.SIGNAL, m.VALVE], program[m.SLOPE, m.VALVE]
    for n in range(lanes):
        w[r.IN_Q + n], w[r.IN_DQ + n] = stages.spool(w, n, g[e, n], g[slope, n])


@njit
def _most(g: Array, n: int, rate: float) -> Any:
    """Feedback of the flow above it would drive the piston away within a step."""
    return 0.25 * rate * g[m.ALPHA_2, n]


@njit
def flow(w: Array, g: Array, program: m.Code, rate: float, acted: bool) -> None:
    """Write the flow into the cylinder, after compiled effects on it where those have acted.

    Feedback beyond `_most` is not followed implicitly.
    """
    lanes = g.shape[1]
    if program[0, m.FLOW] > program[0, m.VALVE]:
        first, d_first = (r.IN_FLOW, r.IN_DFLOW) if acted else (r.IN_Q, r.IN_DQ)
        for n in range(lanes):
            g[m.Q, n] = w[first + n]
        for n in range(lanes):
            g[m.D_Q, n] = w[d_first + n]
        m.execute(g, program, program[0, m.VALVE], program[0, m.FLOW])
        q, slope = program[m.SIGNAL, m.FLOW], program[m.SLOPE, m.FLOW]
        for n in range(lanes):
            w[r.IN_FLOW + n] = g[q, n]
        for n in range(lanes):
            w[r.IN_DFLOW + n] = min(g[slope, n], _most(g, n, rate))
    elif acted:
        for n in range(lanes):
            w[r.IN_DFLOW + n] = min(w[r.IN_DFLOW + n], _most(g, n, rate))
    else:
        for n in range(lanes):
            w[r.IN_FLOW + n] = w[r.IN_Q + n]
            w[r.IN_DFLOW + n] = min(w[r.IN_DQ + n], _most(g, n, rate))


@njit
def force(w: Array, g: Array, program: m.Code, rate: float, yields: bool) -> None:
    """Write the force of specimen and piston at the end of a step by IN_DX, and its slope.

    The velocity is that of the parabola through the last three positions: that of the scheme
    itself may alternate from step to step.
    """
    lanes = g.shape[1]
    for n in range(lanes):
        g[m.F, n], g[m.D_F, n] = balance.specimen(w, n, w[r.IN_DX + n], True, yields)
    for n in range(lanes):
        g[m.X, n] = w[r.X + n] + w[r.IN_DX + n]
    if program[m.SIGNAL, m.PREPARE] & m.NEEDS_V_END:
        for n in range(lanes):
            g[m.V, n] = 0.25 * rate * (3.0 * w[r.IN_DX + n] - w[r.DX + n])
    m.execute(g, program, program[0, m.FLOW], program[0, m.FORCE])
