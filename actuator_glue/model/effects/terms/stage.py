"""Where the compiled step asks effects written as expressions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects import balance, stages
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.terms import machine as m
from actuator_glue.records import Array


# The number of lanes is taken from the table: as a constant it would have short loops unrolled
# before they can become vector code.
@njit
def middle(
    w: Array, g: Array, parts: m.Parts, mean: float, slope: float, rate: float, time: float
) -> None:
    """Write what moves in the middle of the step, as far as it is read.

    The step is not known yet; all is taken as if the piston went on as before, and linear in
    what it does otherwise. `mean` and `time` as in `stages.valve` and `stages.flow`, `slope` as
    in `stages.chains`.
    """
    lanes, needs, half, inverse = g.shape[1], parts[m.NEEDS], 0.5 * rate, 1.0 / rate
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
    if needs & m.NEEDS_X:
        for n in range(lanes):
            g[m.X, n] = w[r.X + n] + 0.5 * w[r.DX + n]
    if needs & m.NEEDS_U:
        for n in range(lanes):
            g[m.U, n] = w[r.GAIN + n] * (mean + w[r.IN_MEAN + n])
    if needs & m.NEEDS_CHANGE:
        for n in range(lanes):
            gain, share, jump = w[r.GAIN + n], w[r.IN_SHARE + n], w[r.IN_JUMP + n]
            g[m.SHARE, n] = share
            g[m.JUMP, n] = gain * jump if share > 0.0 else 0.0
            # The ramp of a jump's first moment is none.
            ramp = slope + w[r.IN_SLOPE + n] - 6.0 * jump * share * (1.0 - share)
            g[m.CHANGE_U, n] = gain * ramp
            g[m.CHANGE_X, n], g[m.CHANGE_F, n] = w[r.DX + n], w[r.DF + n]


@njit
def _most(g: Array, n: int, rate: float) -> Any:
    """Feedback of the flow above it would drive the piston away within a step."""
    return 0.25 * rate * g[m.ALPHA_2, n]


@njit
def valve(w: Array, g: Array, parts: m.Parts, mean: float, rate: float) -> None:
    """Write the spool flow, and as if nothing acted on it that into the cylinder."""
    lanes = g.shape[1]
    if not parts[m.NEEDS] & m.NEEDS_E:
        for n in range(lanes):
            q, dq = stages.valve(w, n, mean)
            w[r.IN_Q + n], w[r.IN_DQ + n] = q, dq
            w[r.IN_FLOW + n], w[r.IN_DFLOW + n] = q, min(dq, _most(g, n, rate))
        return
    if parts[m.COMMAND]:
        m.execute(parts[m.COMMAND], g, w)
        for n in range(lanes):
            g[m.E, n] = stages.error(w, n, g[m.U, n])
    else:
        for n in range(lanes):
            g[m.E, n] = stages.error(w, n, w[r.GAIN + n] * (mean + w[r.IN_MEAN + n]))
    if parts[m.VALVE]:
        m.execute(parts[m.VALVE], g, w)
    for n in range(lanes):
        q, dq = stages.spool(w, n, g[m.E, n], g[m.D_E, n])
        w[r.IN_Q + n], w[r.IN_DQ + n] = q, dq
        w[r.IN_FLOW + n], w[r.IN_DFLOW + n] = q, min(dq, _most(g, n, rate))


@njit
def flow(w: Array, g: Array, parts: m.Parts, rate: float, acted: bool) -> None:
    """Write the flow into the cylinder, after compiled effects on it where those have acted.

    Feedback beyond `_most` is not followed implicitly.
    """
    lanes = g.shape[1]
    if parts[m.FLOW]:
        if parts[m.NEEDS] & m.NEEDS_CHANGE:
            for n in range(lanes):
                g[m.CHANGE_Q, n] = 2.0 * (w[r.IN_Q + n] - w[r.Q + n])
        if acted:
            for n in range(lanes):
                g[m.Q, n], g[m.D_Q, n] = w[r.IN_FLOW + n], w[r.IN_DFLOW + n]
        else:
            for n in range(lanes):
                g[m.Q, n], g[m.D_Q, n] = w[r.IN_Q + n], w[r.IN_DQ + n]
        m.execute(parts[m.FLOW], g, w)
        for n in range(lanes):
            w[r.IN_FLOW + n] = g[m.Q, n]
            w[r.IN_DFLOW + n] = min(g[m.D_Q, n], _most(g, n, rate))
    else:
        for n in range(lanes):
            g[m.Q, n] = w[r.IN_FLOW + n]
            w[r.IN_DFLOW + n] = min(w[r.IN_DFLOW + n], _most(g, n, rate))


@njit
def before_the_oil(
    w: Array,
    g: Array,
    parts: m.Parts,
    on: NDArray[np.bool_],
    mean: float,
    slope: float,
    rate: float,
    time: float,
) -> bool:
    """Write all up to the flow into the cylinder; return whether anything acts on that."""
    flows = on[r.ON_FLOW]
    middle(w, g, parts, mean, slope, rate, time)
    if not (flows or parts[m.NEEDS] & m.NEEDS_VALVE):
        return False
    valve(w, g, parts, mean, rate)
    if flows:
        stages.flow(w, on, time)
    if flows or parts[m.NEEDS] & m.NEEDS_FLOW:
        flow(w, g, parts, rate, flows)
    return True


@njit
def force(w: Array, g: Array, parts: m.Parts, rate: float, yields: bool) -> None:
    """Write the force of specimen and piston at the end of a step by IN_DX, and its slope."""
    _end(w, g, rate, yields)
    m.execute(parts[m.FORCE], g, w)


@njit
def keep(w: Array, g: Array, parts: m.Parts, rate: float, yields: bool) -> None:
    """Let forces remember the step by IN_DX."""
    if parts[m.KEEP]:
        _end(w, g, rate, yields)
        m.execute(parts[m.KEEP], g, w)


@njit
def _end(w: Array, g: Array, rate: float, yields: bool) -> None:
    """Write what moves at the end of a step by IN_DX.

    The velocity is that of the parabola through the last three positions: that of the scheme
    itself may alternate from step to step.
    """
    lanes, quarter = g.shape[1], 0.25 * rate
    for n in range(lanes):
        g[m.F, n], g[m.D_F, n] = balance.specimen(w, n, w[r.IN_DX + n], True, yields)
        g[m.X, n] = w[r.X + n] + w[r.IN_DX + n]
        g[m.V, n] = quarter * (3.0 * w[r.IN_DX + n] - w[r.DX + n])


@njit
def proportional(w: Array, g: Array, parts: m.Parts, rate: float) -> None:
    """Write the increment against a proportional specimen and the force, after Newton steps."""
    balance.begin(w, True)
    for _ in range(parts[m.TIMES]):
        m.execute(parts[m.BALANCE], g, w)
        if parts[m.TIMES] == 1 or balance.settled(w):
            break
    keep(w, g, parts, rate, False)
