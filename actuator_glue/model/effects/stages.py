"""Stages of a sub-step before and after its balance of forces, each for one lane.

Derived in docs/effects_method.md. A value that only one side of a choice needs is loaded before
it: a choice between two loads would stop the compiler from writing vector code.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model.effects import assembly
from actuator_glue.model.effects import layout as r
from actuator_glue.records import Array


@njit
def valve(w: Array, n: int, mean: float) -> Any:
    """Mean spool flow over the step if the piston goes on as before, and d(flow)/d(dx).

    The command's mean is `mean` plus what is the lane's own.
    """
    return spool(w, n, error(w, n, w[r.GAIN + n] * (mean + w[r.IN_MEAN + n])), -0.5)


@njit
def error(w: Array, n: int, u: Any) -> Any:
    """Mean control error over the step, of the command's mean, if the piston goes on."""
    return u + w[r.NULL + n] - w[r.X + n] - 0.5 * w[r.DX + n]


@njit
def spool(w: Array, n: int, error: Any, slope: Any) -> Any:
    """Mean spool flow and d(flow)/d(dx) from the control error and its d/d(dx)."""
    acting = w[r.VALVE_E + n]
    left, kept = assembly.error(w, n, error, slope)
    flow = acting * left + w[r.VALVE_Q + n] * w[r.Q + n] + w[r.VALVE_D + n] * w[r.QD + n]
    return flow, kept * acting


@njit
def flow(w: Array, on: NDArray[np.bool_], time: float) -> None:
    """Write the flow into the cylinder and its d/d(dx): gain of the orifice, then its limit."""
    assembly.gains(w, on, time)
    for n in range(r.LANES):
        through, slope = w[r.IN_Q + n] * w[r.IN_GAIN + n], w[r.IN_DQ + n] * w[r.IN_GAIN + n]
        w[r.IN_FLOW + n], w[r.IN_DFLOW + n] = assembly.limit(w, n, through, slope)


@njit
def drive(w: Array, n: int, flow: Any, dflow: Any) -> Any:
    """What drives the piston: force at rest, the oil's part of it, stiffness of the oil.

    Forces balance where specimen + friction = force at rest - (stiffness + DAMPING_2) dx.
    `flow` is that at the last increment, `dflow` its d/d(dx).
    """
    slope = w[r.FORCE_Q + n] * dflow
    oil = w[r.FORCE_F + n] * w[r.F + n] + w[r.FORCE_Q + n] * flow - slope * w[r.DX + n]
    push = w[r.F + n] + oil - w[r.R + n] + w[r.MASS_4V + n] * w[r.V + n]
    return push, oil, w[r.FORCE_X + n] - slope


@njit
def finish(
    w: Array, n: int, rate: Any, q: Any, dq: Any, push: Any, oil: Any, stiff: Any, dx: Any
) -> None:
    """Carry the state on to the end of the step; a piston that sticks has no velocity."""
    end = oil - stiff * dx
    w[r.DF + n], w[r.F + n] = end - w[r.F + n], end
    w[r.R + n] = push - (stiff + w[r.DAMPING_2 + n]) * dx
    v = rate * dx - w[r.V + n]
    w[r.V + n] = 0.0 if dx == 0.0 else v
    mean = q + dq * (dx - w[r.DX + n])
    w[r.QD + n] = 2.0 * rate * (mean - w[r.Q + n]) - w[r.QD + n]
    w[r.Q + n] = 2.0 * mean - w[r.Q + n]
    w[r.X + n] += dx
    w[r.DX + n] = dx


@njit
def chains(w: Array, n: int, mean: float, slope: float) -> Any:
    """Carry both linear chains on: Eq. (2) exactly, and as the scheme solves it.

    Returns the position without the scheme's own error.
    """
    xe, ve, xt, qt = w[r.X_EXACT + n], w[r.V_EXACT + n], w[r.X_TRAP + n], w[r.Q_TRAP + n]
    u, ramp = mean + w[r.IN_MEAN + n], slope + w[r.IN_SLOPE + n]
    exact = w[r.EXACT_VX + n] * xe + w[r.EXACT_VV + n] * ve
    w[r.V_EXACT + n] = exact + w[r.EXACT_VU + n] * u + w[r.EXACT_VR + n] * ramp
    w[r.Q_TRAP + n] = w[r.TRAP_QX + n] * xt + w[r.TRAP_QQ + n] * qt + w[r.TRAP_QU + n] * u
    exact = w[r.EXACT_XX + n] * xe + w[r.EXACT_XV + n] * ve
    exact += w[r.EXACT_XU + n] * u + w[r.EXACT_XR + n] * ramp
    trap = w[r.TRAP_XX + n] * xt + w[r.TRAP_XQ + n] * qt + w[r.TRAP_XU + n] * u
    w[r.X_EXACT + n], w[r.X_TRAP + n] = exact, trap
    return w[r.X + n] + exact - trap
