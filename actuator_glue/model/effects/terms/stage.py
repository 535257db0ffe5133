"""Where the compiled step asks effects written as expressions."""

from __future__ import annotations

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
    for n in range(lanes):
        g[m.T, n] = time + g[m.ORIGIN, n]
    for n in range(lanes):
        g[m.X, n] = w[r.X + n] + 0.5 * w[r.DX + n]
    for n in range(lanes):
        g[m.V, n] = half * w[r.DX + n]
    for n in range(lanes):
        g[m.Q, n] = w[r.Q + n] + w[r.QD + n] * inverse
    for n in range(lanes):
        g[m.F, n] = w[r.F + n] + 0.5 * w[r.DF + n]
    for n in range(lanes):
        g[m.U, n] = w[r.GAIN + n] * (mean + w[r.IN_MEAN + n])
    m.execute(g, program, program[0, m.PREPARE], program[0, m.COMMAND])
    for n in range(lanes):
        g[m.E, n] = g[m.U, n] + w[r.NULL + n] - g[m.X, n]
    for n in range(lanes):
        g[m.D_E, n] = -0.5
    m.execute(g, program, program[0, m.COMMAND], program[0, m.VALVE])
    for n in range(lanes):
        w[r.IN_Q + n], w[r.IN_DQ + n] = stages.spool(w, n, g[m.E, n], g[m.D_E, n])


@njit
def flow(w: Array, g: Array, program: m.Code, rate: float) -> None:
    """Write the flow into the cylinder after the catalogue's own effects on it."""
    lanes = g.shape[1]
    if program[0, m.FLOW] > program[0, m.VALVE]:
        for n in range(lanes):
            g[m.Q, n] = w[r.IN_FLOW + n]
        for n in range(lanes):
            g[m.D_Q, n] = w[r.IN_DFLOW + n]
        m.execute(g, program, program[0, m.VALVE], program[0, m.FLOW])
        for n in range(lanes):
            w[r.IN_FLOW + n] = g[m.Q, n]
        for n in range(lanes):
            w[r.IN_DFLOW + n] = g[m.D_Q, n]
    for n in range(lanes):
        # Feedback that would drive the piston away within a step is not followed implicitly.
        w[r.IN_DFLOW + n] = min(w[r.IN_DFLOW + n], 0.25 * rate * g[m.ALPHA_2, n])


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
    for n in range(lanes):
        g[m.V, n] = 0.25 * rate * (3.0 * w[r.IN_DX + n] - w[r.DX + n])
    m.execute(g, program, program[0, m.FLOW], program[0, m.FORCE])
