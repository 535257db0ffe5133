"""From physical parameters to the kernel's table (docs/effects_method.md, 'Scheme').

Compiled and written where the kernel reads it: for 32 parameter sets numpy would spend more time
in its calls than in the arithmetic.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model.effects import assembly, catalogue
from actuator_glue.model.effects import layout as r
from actuator_glue.model.effects.stage import Case
from actuator_glue.model.parameters import NAMES as BASE
from actuator_glue.records import Array

# What the compiled step takes of each parameter set.
NAMES: Final = (
    *BASE,
    *(p.name for e in catalogue.ENTRIES if e.stage is not None for p in e.parameters),
    *(state for e in catalogue.ENTRIES for state in e.states),
)
KIND: Final = np.dtype([(name, np.float64) for name in NAMES])

_TERMS: Final = 14  # Taylor terms for arguments below 1/4: 0.25^14/14! is below rounding


@njit
def _exact(a1: float, a0: float, step: float) -> tuple[float, float, float]:
    """Return position after a unit step of acceleration, its derivative and its integral.

    x'' + a1 x' + a0 x = 1 from rest at time `step`; Taylor series of the scaled system, then
    doubled back (the transition matrix follows from both).
    """
    size = max(abs(a1), math.sqrt(abs(a0))) * step
    doublings = 0
    if 0.25 < size < math.inf:
        doublings = min(math.ceil(math.log2(size / 0.25)), 60)
    t = step / 2.0**doublings
    e1, e2 = -a1 * t, a0 * t * t
    h_old, h = 0.0, 1.0
    factorial, s1, s2, s3 = 1.0, 0.0, 0.0, 0.0
    for n in range(_TERMS):
        factorial *= n + 1
        s1 += h / factorial
        s2 += h / (factorial * (n + 2))
        s3 += h / (factorial * (n + 2) * (n + 3))
        h_old, h = h, e1 * h - e2 * h_old
    velocity, position, ramp = t * s1, t * t * s2, t * t * t * s3
    for _ in range(doublings):
        f11 = 1.0 - a0 * position
        f22 = f11 - a1 * velocity
        ramp = (1.0 + f11) * ramp + (t + velocity) * position
        position += f11 * position + velocity * velocity
        velocity *= f11 + f22
        t *= 2.0
    return position, velocity, ramp


@njit
def _valve(w: Array, n: int, p: Any, step: float) -> None:
    """Valve T q'' + q' + beta_1 q = n0 e by the trapezoidal rule: mean flow over the step."""
    half = 0.5 * step
    below = 1.0 + p.beta_1 * half + 2.0 * assembly.valve_lag(p) / step
    w[r.VALVE_E + n] = half * p.alpha_1_beta_0 / below
    w[r.VALVE_Q + n] = 1.0 - half * p.beta_1 / below
    w[r.VALVE_D + n] = assembly.valve_lag(p) / below


@njit
def _forces(w: Array, n: int, p: Any, k: float, step: float) -> None:
    """Oil by the trapezoidal rule, inertia and damping, and one over what resists an increment."""
    below = 1.0 + 0.5 * step * p.alpha_3
    w[r.FORCE_F + n] = (2.0 - below) / below
    w[r.FORCE_Q + n] = step / below
    w[r.FORCE_X + n] = p.alpha_2 / below
    damping, mass = assembly.damping(p), assembly.mass(p)
    w[r.DAMPING_2 + n] = 2.0 * damping / step + 4.0 * mass / (step * step)
    w[r.MASS_4V + n] = 4.0 * mass / step
    idle = w[r.FORCE_X + n] + w[r.DAMPING_2 + n]
    acting = idle + 0.5 * w[r.FORCE_Q + n] * w[r.VALVE_E + n]
    w[r.ACTING_TOUCHED + n], w[r.IDLE_TOUCHED + n] = 1.0 / (acting + k), 1.0 / (idle + k)
    w[r.ACTING_FREE + n], w[r.IDLE_FREE + n] = 1.0 / acting, 1.0 / idle


@njit
def _chains(w: Array, n: int, p: Any, k: float, step: float) -> None:
    """Both linear chains: Eq. (2) exactly in (x, v), and by the scheme in (x, q)."""
    b1, n0, oil = p.beta_1, p.alpha_1_beta_0, k + p.alpha_2
    a1 = (p.alpha_3 * k + b1 * oil) / oil
    a0 = (b1 * p.alpha_3 * k + n0) / oil
    position, velocity, ramp = _exact(a1, a0, step)
    into = assembly.gain(p) * n0 / oil
    w[r.EXACT_XX + n] = 1.0 - a0 * position
    w[r.EXACT_XV + n] = velocity
    w[r.EXACT_XU + n] = into * position
    w[r.EXACT_XR + n] = into * (ramp / step - 0.5 * position)
    w[r.EXACT_VX + n] = -a0 * velocity
    w[r.EXACT_VV + n] = 1.0 - a0 * position - a1 * velocity
    w[r.EXACT_VU + n] = into * velocity
    w[r.EXACT_VR + n] = into * (position / step - 0.5 * velocity)

    below = 1.0 + 0.5 * step * b1
    from_e = 0.5 * step * n0 / below
    from_q = 1.0 - 0.5 * step * b1 / below
    force_f, force_q = w[r.FORCE_F + n], w[r.FORCE_Q + n]
    stiff = w[r.FORCE_X + n] + k + 0.5 * force_q * from_e
    dx_x = ((force_f - 1.0) * k - force_q * from_e) / stiff
    dx_q = force_q * from_q / stiff
    dx_u = force_q * from_e / stiff
    w[r.TRAP_XX + n] = 1.0 + dx_x
    w[r.TRAP_XQ + n] = dx_q
    w[r.TRAP_XU + n] = assembly.gain(p) * dx_u
    w[r.TRAP_QX + n] = -2.0 * from_e * (1.0 + 0.5 * dx_x)
    w[r.TRAP_QQ + n] = 2.0 * from_q - 1.0 - from_e * dx_q
    w[r.TRAP_QU + n] = assembly.gain(p) * 2.0 * from_e * (1.0 - 0.5 * dx_u)


@njit
def _start(w: Array, n: int, p: Any, case: Case) -> None:
    """The state at the first sample, as if the piston had gone on at this velocity."""
    k, x, v = case.k, case.x, case.v
    w[r.X + n], w[r.X_EXACT + n], w[r.X_TRAP + n] = x, x, x
    w[r.V + n], w[r.V_EXACT + n] = v, v
    w[r.DX + n] = v * case.step
    # What damps the motion loads the piston.
    damping = assembly.damping(p)
    w[r.R + n] = k * x
    w[r.F + n] = k * x + damping * v
    w[r.Q_TRAP + n] = (k + p.alpha_2) * v + p.alpha_3 * k * x
    w[r.Q + n] = w[r.Q_TRAP + n] + p.alpha_3 * damping * v


@njit(nogil=True)
def fill(
    parameters: Any, stiffness: float, step: float, period: float, x: Array, v: Array, out: Array
) -> None:
    """Write the kernel's tables at the first sample.

    Args:
        parameters: (m,) of KIND.
        stiffness: specimen stiffness k [N/m].
        step: sub-step [s].
        period: sample period [s].
        x: position at the first sample, (m,) [m].
        v: velocity there, (m,) [m/s].
        out: (blocks, assembly.SIZE) of zeros; the last block is filled up by repeating the last
            set.
    """
    for i in range(len(out) * r.LANES):
        w, n, at = out[i // r.LANES], i % r.LANES, min(i, len(parameters) - 1)
        p = parameters[at]
        case = Case(stiffness, step, period, x[at], v[at])
        w[r.GAIN + n] = assembly.gain(p)
        w[r.LAG_SAMPLES + n], w[r.SKEW + n] = assembly.delay(p) / period, assembly.skew(p)
        w[r.NULL + n], w[r.COULOMB + n] = assembly.offset(p), assembly.dry(p)
        w[r.NULL_ALONE + n] = w[r.NULL + n]
        w[r.STIFFNESS + n] = stiffness
        _valve(w, n, p, step)
        _forces(w, n, p, stiffness, step)
        _chains(w, n, p, stiffness, step)
        _start(w, n, p, case)
        assembly.fill(w, n, p, case)
