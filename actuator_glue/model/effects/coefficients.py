"""From physical parameters to the kernel's coefficient table (docs/effects.md, 'Scheme')."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator_glue.model.effects import kernel as k
from actuator_glue.records import Array

# A limit at or above this velocity is no limit: the neutral value of flow-saturation.
NO_LIMIT = 2.0  # m/s
# The rise of dry friction follows a change of velocity with this time constant (frictional
# memory), or with MEMORY_MARGIN rise / ((k + alpha_2) v_s) where that is longer: the steepest
# fall of the Stribeck curve is 0.86 rise / v_s, and a massless specimen has one velocity only
# where the memory is longer than 0.86 rise / ((k + alpha_2) v_s).
FRICTION_MEMORY = 2e-3  # s
MEMORY_MARGIN = 1.72

_TERMS = 14  # Taylor terms for arguments below 1/4: 0.25^14/14! is below rounding


def _exact(a1: Array, a0: Array, step: float) -> tuple[Array, Array, Array]:
    """Return position after a unit step of acceleration, its derivative and its integral.

    x'' + a1 x' + a0 x = 1 from rest at time `step`; Taylor series of the scaled system, then
    doubled back (the transition matrix follows from both).
    """
    size = np.maximum(np.abs(a1) * step, np.sqrt(np.abs(a0)) * step)
    doublings = np.clip(np.ceil(np.log2(size / 0.25)), 0, 60)
    doublings = np.where(np.isfinite(doublings), doublings, 0)
    t = step / 2.0**doublings
    e1, e2 = -a1 * t, a0 * t * t
    h_old, h = np.zeros_like(t), np.ones_like(t)
    factorial = 1.0
    s1, s2, s3 = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
    for n in range(_TERMS):
        factorial *= n + 1
        s1 = s1 + h / factorial
        s2 = s2 + h / (factorial * (n + 2))
        s3 = s3 + h / (factorial * (n + 2) * (n + 3))
        h_old, h = h, e1 * h - e2 * h_old
    velocity, position, ramp = t * s1, t * t * s2, t * t * t * s3
    for n in range(int(doublings.max(initial=0.0))):
        more = n < doublings
        f11 = 1.0 - a0 * position
        f22 = f11 - a1 * velocity
        ramp = np.where(more, (1.0 + f11) * ramp + (t + velocity) * position, ramp)
        position, velocity = (
            np.where(more, position + f11 * position + velocity * velocity, position),
            np.where(more, velocity * (f11 + f22), velocity),
        )
        t = np.where(more, 2.0 * t, t)
    return position, velocity, ramp


def build(
    values: Mapping[str, Array], stiffness: float, step: float, period: float
) -> dict[int, Array]:
    """Return the coefficient rows of the kernel's table, each (m,), by where they begin.

    Args:
        values: every base and effect parameter of the compiled stages by name, each (m,).
        stiffness: specimen stiffness k [N/m].
        step: sub-step [s].
        period: sample period [s].
    """
    v = values
    b1, n0, a2, a3 = v['beta_1'], v['alpha_1_beta_0'], v['alpha_2'], v['alpha_3']
    c: dict[int, Array] = {}
    half = 0.5 * step

    c[k.GAIN] = v['gain']
    c[k.LAG_SAMPLES] = v['delay'] / period
    c[k.SKEW] = v['clock_skew']
    c[k.NULL] = v['null_offset']
    c[k.DEADBAND] = v['deadband']

    # Valve T q'' + q' + beta_1 q = n0 e by the trapezoidal rule: mean flow over the step.
    lag = v['valve_lag']
    below = 1.0 + b1 * half + 2.0 * lag / step
    c[k.VALVE_E] = half * n0 / below
    c[k.VALVE_Q] = 1.0 - half * b1 / below
    c[k.VALVE_D] = lag / below

    limit = v['saturation_velocity']
    c[k.SATURATION] = np.where(limit >= NO_LIMIT, np.inf, limit * a2)
    c[k.ASYMMETRY] = v['asymmetry']
    c[k.INVERSE_STALL] = v['inverse_stall_force']
    c[k.DROOP] = v['droop']
    c[k.DROOP_HALF] = half / (v['droop_time'] + half)
    c[k.GAIN_DRIFT] = v['gain_drift']
    c[k.INVERSE_ALPHA_2] = 1.0 / a2

    c[k.FORCE_F] = (1.0 - half * a3) / (1.0 + half * a3)
    c[k.FORCE_Q] = step / (1.0 + half * a3)
    c[k.FORCE_X] = a2 / (1.0 + half * a3)

    c[k.STIFFNESS] = np.full_like(b1, stiffness)
    damping = v['damping'] + v['mass'] * v['mass_damping']
    c[k.DAMPING_2] = 2.0 * damping / step + 4.0 * v['mass'] / step**2
    c[k.MASS_4V] = 4.0 * v['mass'] / step

    c[k.COULOMB] = v['coulomb_force'] + v['sliding_force']
    rise = v['sliding_force'] * (v['breakaway_ratio'] - 1.0)
    speed = v['stribeck_velocity']
    c[k.STRIBECK_EXTRA] = rise
    c[k.STRIBECK_RATE] = 1.0 / (step * speed)
    memory = np.maximum(FRICTION_MEMORY, MEMORY_MARGIN * rise / ((stiffness + a2) * speed))
    c[k.STRIBECK_LAG] = np.exp(-step / memory)

    c[k.GAP] = v['gap']
    c[k.HARDENING] = v['hardening']
    # Past the peak of a softening spring (3 |kappa| x^2 = 1) the secant stays.
    c[k.HARDENING_CAP] = np.where(
        v['hardening'] < 0.0, 1.0 / (3.0 * np.abs(v['hardening'])), np.inf
    )
    c[k.INVERSE_YIELD] = 1.0 / v['yield_displacement']
    c[k.YIELD] = v['yield_displacement']
    c[k.YIELD_RATIO] = v['post_yield_ratio']
    for power, row in enumerate((k.SHARP_1, k.SHARP_2, k.SHARP_4, k.SHARP_8, k.SHARP_16)):
        c[row] = np.maximum(0.0, 1.0 - np.abs(v['yield_sharpness'] - power))

    c[k.BACKLASH] = v['backlash']
    c[k.SENSOR_LAG] = v['sensor_lag'] / step
    c[k.SENSOR_DECAY] = np.exp(-step / v['sensor_lag'])

    _linear(c, b1, n0, a2, a3, stiffness, step)
    return c


def _linear(
    c: dict[int, Array], b1: Array, n0: Array, a2: Array, a3: Array, stiffness: float, step: float
) -> None:
    """Write both linear chains: Eq. (2) exactly in (x, v), and by the scheme in (x, q)."""
    d2 = stiffness + a2
    a1 = (a3 * stiffness + b1 * d2) / d2
    a0 = (b1 * a3 * stiffness + n0) / d2
    position, velocity, ramp = _exact(a1, a0, step)
    c[k.EXACT_XX] = 1.0 - a0 * position
    c[k.EXACT_XV] = velocity
    c[k.EXACT_XU] = n0 / d2 * position
    c[k.EXACT_XR] = n0 / d2 * (ramp / step - 0.5 * position)
    c[k.EXACT_VX] = -a0 * velocity
    c[k.EXACT_VV] = c[k.EXACT_XX] - a1 * velocity
    c[k.EXACT_VU] = n0 / d2 * velocity
    c[k.EXACT_VR] = n0 / d2 * (position / step - 0.5 * velocity)

    below = 1.0 + 0.5 * step * b1
    from_e = 0.5 * step * n0 / below
    from_q = 1.0 - 0.5 * step * b1 / below
    force_f, force_q = c[k.FORCE_F], c[k.FORCE_Q]
    stiff = c[k.FORCE_X] + stiffness + 0.5 * force_q * from_e
    dx_x = ((force_f - 1.0) * stiffness - force_q * from_e) / stiff
    dx_q = force_q * from_q / stiff
    dx_u = force_q * from_e / stiff
    c[k.TRAP_XX] = 1.0 + dx_x
    c[k.TRAP_XQ] = dx_q
    c[k.TRAP_XU] = dx_u
    c[k.TRAP_QX] = -2.0 * from_e * (1.0 + 0.5 * dx_x)
    c[k.TRAP_QQ] = 2.0 * from_q - 1.0 - from_e * dx_q
    c[k.TRAP_QU] = 2.0 * from_e * (1.0 - 0.5 * dx_u)
