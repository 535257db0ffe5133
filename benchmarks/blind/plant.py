"""The judge's own plant: RK4 (friction: return mapping) at a fine step, no code of the model.

State equations after the paper's Eqs. (1), (2), written here from the page on purpose: a bug
shared with actuator_glue.model would make the benchmark blind to it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from sizing import FINE

RATE = 256.0

# Every effect's number and its neutral value; what each means is in cases.py.
NEUTRAL = {
    'delay': 0.0,
    'command_gain': 1.0,
    'valve_lag': 0.0,  # time constant of a second valve pole [s]
    'deadband': 0.0,  # half width, at the valve input [m]
    'null': 0.0,
    'max_flow': 0.0,  # 0: none; in terms of loop flow [N/s]
    'supply_force': 0.0,  # 0: none; square-root pressure-flow
    'asymmetry': 0.0,
    'droop': 0.0,
    'droop_flow': 1.0,
    'droop_time': 1.0,
    'gain_drift': 0.0,
    'coulomb': 0.0,
    'stribeck': 0.0,
    'stribeck_speed': 1e-2,
    'play': 0.0,
    'viscous': 0.0,
    'mass': 0.0,
    'gap': 0.0,
    'hardening': 0.0,
    'yield_displacement': 0.0,
    'yield_ratio': 1.0,
    # Not in the catalogue.
    'turbulent_leak': 0.0,  # of the flow, per (N/s)
    'rate_gain': 0.0,  # u (1 + c |du/dt|)
    'position_gain': 0.0,  # flow gain (1 + c (x / 2 mm)^2)
    'delay_wobble': 0.0,
    'delay_wobble_hz': 0.0,
    'stick_rate': 0.0,
    'stick_time': 0.0,
    'feedback_lag': 0.0,
    'flow_ripple': 0.0,
    'flow_ripple_hz': 0.0,
}
INDEX = {name: i for i, name in enumerate(NEUTRAL)}
(
    DELAY,
    GAIN,
    VALVE_LAG,
    DEADBAND,
    NULL,
    MAX_FLOW,
    SUPPLY,
    ASYMMETRY,
    DROOP,
    DROOP_FLOW,
    DROOP_TIME,
    DRIFT,
    COULOMB,
    STRIBECK,
    STRIBECK_SPEED,
    PLAY,
    VISCOUS,
    MASS,
    GAP,
    HARDENING,
    YIELD_X,
    YIELD_RATIO,
    LEAK,
    RATE_GAIN,
    POSITION_GAIN,
    WOBBLE,
    WOBBLE_HZ,
    STICK_RATE,
    STICK_TIME,
    FEEDBACK_LAG,
    RIPPLE,
    RIPPLE_HZ,
) = range(len(NEUTRAL))


@njit(cache=True)
def _spring(x, z, k, e):
    """Specimen force of displacement x and hysteretic state z, and its tangent."""
    if e[GAP] > 0.0:
        if abs(x) <= e[GAP]:
            return 0.0, 0.0
        return k * (x - math.copysign(e[GAP], x)), k
    if e[HARDENING] != 0.0:
        return k * x * (1.0 + e[HARDENING] * x * x), k * (1.0 + 3.0 * e[HARDENING] * x * x)
    if e[YIELD_X] > 0.0:
        return k * (e[YIELD_RATIO] * x + (1.0 - e[YIELD_RATIO]) * z), k
    return k * x, k


@njit(cache=True)
def _valve_rate(q, q2, s, xs, u, t, theta, e):
    """Rates of the valve states and the flow that reaches the piston, before its load."""
    error = u - xs
    if e[DEADBAND] > 0.0:
        error = 0.0 if abs(error) <= e[DEADBAND] else error - math.copysign(e[DEADBAND], error)
    error += e[NULL]
    if e[VALVE_LAG] > 0.0:
        dq2 = (error - q2) / e[VALVE_LAG]
        drive = q2
    else:
        dq2 = 0.0
        drive = error
    gain = 1.0 + e[DRIFT] * t / 60.0
    if e[RIPPLE] != 0.0:
        gain *= 1.0 + e[RIPPLE] * math.sin(2.0 * math.pi * e[RIPPLE_HZ] * t)
    dq = -theta[0] * q + theta[1] * gain * drive
    flow = q
    if e[DROOP] != 0.0:
        flow *= 1.0 - e[DROOP] * s
    if e[ASYMMETRY] != 0.0 and flow > 0.0:
        flow *= 1.0 + e[ASYMMETRY]
    elif e[ASYMMETRY] != 0.0:
        flow *= 1.0 - e[ASYMMETRY]
    if e[POSITION_GAIN] != 0.0:
        flow *= 1.0 + e[POSITION_GAIN] * (xs / 2e-3) ** 2
    if e[MAX_FLOW] > 0.0:
        flow = min(max(flow, -e[MAX_FLOW]), e[MAX_FLOW])
    return dq, dq2, flow


@njit(cache=True)
def _rates(y, u, t, theta, k, e, out):
    """Right side for y = (q, q2, x, v, f, z, s, xs)."""
    q, q2, x, v, f, z, s, xs = y
    if e[FEEDBACK_LAG] <= 0.0:
        xs = x
    dq, dq2, flow = _valve_rate(q, q2, s, xs, u, t, theta, e)
    spring, tangent = _spring(x, z, k, e)
    free = e[MASS] <= 0.0 and e[VISCOUS] <= 0.0
    force = spring if free else f
    if e[SUPPLY] > 0.0:
        flow *= math.sqrt(max(0.0, 1.0 - math.copysign(1.0, flow) * force / e[SUPPLY]))
    leak = theta[3] * force
    if e[LEAK] != 0.0:
        leak += e[LEAK] * force * math.sqrt(abs(force))
    if free:
        if e[YIELD_X] > 0.0:
            # Bouc-Wen, n = 2: dz = v (1 - (z/xy)^2 (sgn(v z) + 1)/2); slope needed at once.
            net = flow - leak
            moving_in = 1.0 if net * z > 0.0 else 0.0
            slope = 1.0 - (z / e[YIELD_X]) ** 2 * moving_in
            tangent = k * (e[YIELD_RATIO] + (1.0 - e[YIELD_RATIO]) * slope)
            v = net / (tangent + theta[2])
            dz = v * slope
        else:
            v = (flow - leak) / (tangent + theta[2])
            dz = 0.0
        dv = 0.0
        df = 0.0
    else:
        dz = 0.0
        if e[MASS] > 0.0:
            dv = (f - spring - e[VISCOUS] * v) / e[MASS]
        else:
            v = (f - spring) / e[VISCOUS]
            dv = 0.0
        df = flow - leak - theta[2] * v
    out[0] = dq
    out[1] = dq2
    out[2] = v
    out[3] = dv
    out[4] = df
    out[5] = dz
    out[6] = 0.0 if e[DROOP] == 0.0 else (abs(q) / e[DROOP_FLOW] - s) / e[DROOP_TIME]
    out[7] = 0.0 if e[FEEDBACK_LAG] <= 0.0 else (x - xs) / e[FEEDBACK_LAG]


@njit(cache=True)
def _friction_step(y, u, t, h, theta, k, e, rates):
    """One step with dry friction: valve explicit at the midpoint, piston by return mapping."""
    dq, dq2, _ = _valve_rate(y[0], y[1], y[6], y[2], u, t, theta, e)
    q_mid, q2_mid = y[0] + 0.5 * h * dq, y[1] + 0.5 * h * dq2
    dq, dq2, flow = _valve_rate(q_mid, q2_mid, y[6], y[2] + 0.5 * h * y[3], u, t, theta, e)
    y[0] += h * dq
    y[1] += h * dq2
    f_stuck = y[4] + h * (flow - theta[3] * y[4])
    spring, tangent = _spring(y[2], y[5], k, e)
    limit = e[COULOMB] + e[STRIBECK] * math.exp(-((y[3] / e[STRIBECK_SPEED]) ** 2))
    trial = f_stuck - spring
    if abs(trial) <= limit:
        y[3] = 0.0
        y[4] = f_stuck
    else:
        dx = (trial - math.copysign(limit, trial)) / (tangent + theta[2])
        y[2] += dx
        y[3] = dx / h
        y[4] = f_stuck - theta[2] * dx


@njit(cache=True)
def respond(command, theta, k, e, substeps, sticks):
    """Piston displacement `FINE` times in each sample of a held command (n,) [m], from rest.

    `substeps` is a multiple of `FINE`; `sticks` (n,) bool: the piston is held during these samples
    (random sticking).
    """
    n, every = command.shape[0], substeps // FINE
    h = 1.0 / (RATE * substeps)
    y = np.zeros(8)
    rates = np.zeros((4, 8))
    trial = np.zeros(8)
    out = np.empty(n * FINE)
    dry = e[COULOMB] > 0.0 or e[STRIBECK] > 0.0
    for i in range(n):
        for j in range(substeps):
            if j % every == 0:
                out[i * FINE + j // every] = y[2]
            t = (i + j / substeps) / RATE
            lag = e[DELAY]
            if e[WOBBLE] != 0.0:
                lag += e[WOBBLE] * (1.0 + math.sin(2.0 * math.pi * e[WOBBLE_HZ] * t))
            late = i + j / substeps - lag * RATE + 1e-9
            at = math.floor(late)
            u = command[at] if at >= 0 else 0.0
            # The mean over the step, where the next sample arrives within it.
            held = (at + 1 - late) * substeps
            if held < 1.0 and -1 <= at < n - 1:
                u = held * u + (1.0 - held) * command[at + 1]
            if e[RATE_GAIN] != 0.0 and at > 0:
                u *= 1.0 + e[RATE_GAIN] * abs(command[at] - command[at - 1]) * RATE
            u *= e[GAIN]
            before = y[2]
            if dry:
                _friction_step(y, u, t, h, theta, k, e, rates)
            else:
                _rates(y, u, t, theta, k, e, rates[0])
                for stage in range(1, 4):
                    w = h if stage == 3 else 0.5 * h
                    for c in range(8):
                        trial[c] = y[c] + w * rates[stage - 1, c]
                    _rates(trial, u, t + w, theta, k, e, rates[stage])
                for c in range(8):
                    y[c] += (
                        h
                        / 6.0
                        * (rates[0, c] + 2.0 * rates[1, c] + 2.0 * rates[2, c] + rates[3, c])
                    )
            if sticks[i]:
                y[2] = before
        if not -1.0 < y[2] < 1.0:
            out[i * FINE :] = np.nan
            break
    return out


@njit(cache=True)
def play(x, half_width):
    """Play operator of half width [m] along x (n,)."""
    out = np.empty_like(x)
    w = 0.0
    for i in range(x.shape[0]):
        w = min(max(w, x[i] - half_width), x[i] + half_width)
        out[i] = w
    return out
