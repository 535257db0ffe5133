"""One compiled step of the servo-hydraulic loop with every effect, many parameter sets at once.

Derivation in docs/effects.md. Per sub-step one scalar equation is solved for the displacement
increment: trapezoidal rule in the valve, the oil and the specimen, one Newton step from the last
increment, and a return mapping for dry friction (unconditionally stable, no branch per lane).
Each stage is a loop over lanes that the compiler turns into vector code; a stage whose effects
are off is skipped, so that the cost follows the number of effects switched on.

The scheme's own error on the linear model is removed at every step: the exact solution of Eq. (2)
and the scheme's solution of Eq. (2) run along and their difference is added to the displacement.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.records import Array

LANES = 32

# Where each row of the table begins, one column per parameter set. The table is flat: only then
# does the compiler see that rows do not overlap, and writes vector code for long stages.
# Coefficients (filled by coefficients.py) ...
(
    GAIN, LAG_SAMPLES, SKEW, NULL, DEADBAND,
    VALVE_E, VALVE_Q, VALVE_D,
    SATURATION, ASYMMETRY, INVERSE_STALL, DROOP, DROOP_HALF, GAIN_DRIFT, INVERSE_ALPHA_2,
    FORCE_F, FORCE_Q, FORCE_X,
    STIFFNESS, DAMPING_2, MASS_4V,
    COULOMB, STRIBECK_EXTRA, STRIBECK_RATE, STRIBECK_LAG,
    GAP, HARDENING, HARDENING_CAP, YIELD, INVERSE_YIELD, YIELD_RATIO,
    SHARP_1, SHARP_2, SHARP_4, SHARP_8, SHARP_16,
    BACKLASH, SENSOR_LAG, SENSOR_DECAY,
    EXACT_XX, EXACT_XV, EXACT_XU, EXACT_XR, EXACT_VX, EXACT_VV, EXACT_VU, EXACT_VR,
    TRAP_XX, TRAP_XQ, TRAP_XU, TRAP_QX, TRAP_QQ, TRAP_QU,
    # ... states (filled by run.py, carried on by `advance`) ...
    X, Q, QD, F, R, V, DX, DF, Z, ENVELOPE, LEVEL, PLAY, PLAY_DX, SENSED,
    X_EXACT, V_EXACT, X_TRAP, Q_TRAP,
    # ... and scratch within one step.
    _U, _RAMP, _QM, _QR, _QG, _FQ, _FR, _G, _MOVED, _RISE, _REST, _OIL,
) = range(0, 83 * LANES, LANES)  # fmt: skip
SIZE = 83 * LANES

# Switches: one flag per stage that can be skipped; ON_FLOW for any effect on the flow, ON_CURVED
# for any that makes the balance of forces nonlinear.
(
    ON_LAG, ON_FLOW, ON_PRESSURE, ON_DROOP, ON_CURVED, ON_STRIBECK, ON_GAP, ON_YIELD,
    ON_TRANSDUCER,
) = range(9)  # fmt: skip
SWITCHES = 9


@njit(inline='always')
def held(u: Array, at: int) -> Any:
    """Command sample `at`, held constant before the first and after the last one."""
    return u[min(max(at, 0), u.shape[0] - 1)]


@njit(inline='always')
def _command(u: Array, offset: int, start: float, stop: float, linear: bool) -> Any:
    """Mean and slope of the held command over [start, stop] samples (at most one sample long).

    The slope is that of the ramp with the same first moment: with both, any fractional shift of
    a held command keeps its integral and its centre.
    """
    i, k = math.floor(start), math.floor(stop)
    left, right = held(u, i - offset), held(u, k - offset)
    if not linear:
        share = (stop - k) / (stop - start) if k > i else 0.0
        jump = right - left
        return left + jump * share, 6.0 * jump * share * (1.0 - share)
    first = left + (start - i) * (held(u, i + 1 - offset) - left)
    last = right + (stop - k) * (held(u, k + 1 - offset) - right)
    if k == i:
        return 0.5 * (first + last), last - first
    share = (stop - k) / (stop - start)
    before, after = (first + right) * (1.0 - share), (right + last) * share
    # 12 times the moment of the triangle by which a kink leaves the straight line.
    kink = right - first * share - last * (1.0 - share)
    return 0.5 * (before + after), last - first + kink * (1.0 - 2.0 * share)


@njit(inline='always')
def _valve(w: Array, n: int) -> Any:
    """Mean spool flow over the step if the piston goes on as before, and d(flow)/d(dx)."""
    error = w[_U + n] + w[NULL + n] - w[X + n] - 0.5 * w[DX + n]
    band = w[DEADBAND + n]
    left = error - min(max(error, -band), band)
    flow = w[VALVE_E + n] * left + w[VALVE_Q + n] * w[Q + n] + w[VALVE_D + n] * w[QD + n]
    return flow, (-0.5 * w[VALVE_E + n] if abs(error) >= band else 0.0)


@njit(inline='always')
def _flow(w: Array, on: NDArray[np.bool_], time: float) -> None:
    """Write the flow into the cylinder and its d/d(dx): gain of the orifice, then its limit."""
    for n in range(LANES):
        side = w[ASYMMETRY + n] if w[_QM + n] > 0.0 else -w[ASYMMETRY + n]
        w[_QG + n] = max(1.0 + w[GAIN_DRIFT + n] * time, 0.0) * (1.0 + side)
    if on[ON_PRESSURE]:
        for n in range(LANES):
            load = (w[F + n] + 0.5 * w[DF + n]) * w[INVERSE_STALL + n]
            w[_QG + n] *= math.sqrt(max(1.0 - (load if w[_QM + n] > 0.0 else -load), 0.0))
    if on[ON_DROOP]:
        for n in range(LANES):
            before = w[ENVELOPE + n]
            speed = abs(w[_QM + n]) * w[INVERSE_ALPHA_2 + n]
            middle = before + w[DROOP_HALF + n] * (speed - before)
            w[_QG + n] *= math.sqrt(max(1.0 - w[DROOP + n] * middle, 0.0))
            w[ENVELOPE + n] = 2.0 * middle - before
    for n in range(LANES):
        through, limit = w[_QM + n] * w[_QG + n], w[SATURATION + n]
        w[_FQ + n] = min(max(through, -limit), limit)
        w[_FR + n] = w[_QR + n] * w[_QG + n] if abs(through) <= limit else 0.0


@njit(inline='always')
def _balance(w: Array, n: int, q: Any, dq: Any, f: Any, df: Any, dry: Any, guess: Any) -> Any:
    """Solve the balance of forces: increment, force beyond inertia and damping, oil force.

    A trial without slip first; dry friction takes what it can and the rest moves the piston.
    q is the flow at the last increment, f the specimen force at the guess; dq, df: d/d(dx).
    """
    slope = w[FORCE_Q + n] * dq
    static = f - df * guess
    oil = w[FORCE_F + n] * w[F + n] + w[FORCE_Q + n] * q - slope * w[DX + n]
    trial = w[F + n] + oil - w[R + n] - static + w[MASS_4V + n] * w[V + n]
    friction = min(max(trial, -dry), dry)
    dx = (trial - friction) / (w[FORCE_X + n] - slope + df + w[DAMPING_2 + n])
    return dx, static + df * dx + friction, oil + (slope - w[FORCE_X + n]) * dx


@njit(inline='always')
def _finish(w: Array, n: int, rate: Any, q: Any, dq: Any, dx: Any, rest: Any, oil: Any) -> None:
    """Carry the state on to the end of the step; a piston that sticks has no velocity."""
    w[DF + n], w[F + n], w[R + n] = oil - w[F + n], oil, rest
    v = rate * dx - w[V + n]
    w[V + n] = 0.0 if dx == 0.0 else v
    mean = q + dq * (dx - w[DX + n])
    w[QD + n] = 2.0 * rate * (mean - w[Q + n]) - w[QD + n]
    w[Q + n] = 2.0 * mean - w[Q + n]
    w[X + n] += dx
    w[DX + n] = dx


@njit(inline='always')
def _chains(w: Array, n: int) -> None:
    """Carry both linear chains on: Eq. (2) exactly, and as the scheme solves it."""
    xe, ve, xt, qt = w[X_EXACT + n], w[V_EXACT + n], w[X_TRAP + n], w[Q_TRAP + n]
    c, r = w[_U + n], w[_RAMP + n]
    exact = w[EXACT_XX + n] * xe + w[EXACT_XV + n] * ve
    w[X_EXACT + n] = exact + w[EXACT_XU + n] * c + w[EXACT_XR + n] * r
    exact = w[EXACT_VX + n] * xe + w[EXACT_VV + n] * ve
    w[V_EXACT + n] = exact + w[EXACT_VU + n] * c + w[EXACT_VR + n] * r
    w[X_TRAP + n] = w[TRAP_XX + n] * xt + w[TRAP_XQ + n] * qt + w[TRAP_XU + n] * c
    w[Q_TRAP + n] = w[TRAP_QX + n] * xt + w[TRAP_QQ + n] * qt + w[TRAP_QU + n] * c


@njit(inline='always')
def _transducer(w: Array, n: int) -> None:
    """Play, then the first-order lag of the parabola through the last three positions."""
    corrected = w[X + n] + w[X_EXACT + n] - w[X_TRAP + n]
    before, lag = w[PLAY + n], w[SENSOR_LAG + n]
    # In this order a position that is not a number goes through.
    after = min(corrected + w[BACKLASH + n], max(corrected - w[BACKLASH + n], before))
    moved = after - before
    bend = 0.5 * (moved - w[PLAY_DX + n])
    end = after - lag * (moved + bend - 2.0 * lag * bend)
    first = before - lag * (moved - bend - 2.0 * lag * bend)
    w[SENSED + n] = end + w[SENSOR_DECAY + n] * (w[SENSED + n] - first)
    w[PLAY + n] = after
    w[PLAY_DX + n] = moved


@njit(inline='always')
def _friction_rise(w: Array, n: int) -> Any:
    """Rise of dry friction over its sliding value at the end of a step by _G."""
    ratio = w[_G + n] * w[STRIBECK_RATE + n]
    # exp(-z) as a Pade quotient to the 16th power: vector code, error below 1e-6.
    s = min(ratio * ratio, 40.0) * 0.0625
    e = (1.0 - 0.5 * s + s * s / 12.0) / (1.0 + 0.5 * s + s * s / 12.0)
    e = e * e
    e = e * e
    e = e * e
    wish = w[STRIBECK_EXTRA + n] * e * e
    return wish + (w[LEVEL + n] - wish) * w[STRIBECK_LAG + n]


@njit(inline='always')
def _look(w: Array, n: int, yields: bool) -> None:
    """Balance of forces with the specimen's force and tangent at the end expected by _G."""
    here, there, g = w[X + n], w[X + n] + w[_G + n], w[GAP + n]
    after = there - min(max(there, -g), g)
    square, cap, ratio = after * after, w[HARDENING_CAP + n], w[YIELD_RATIO + n]
    cubic = w[HARDENING + n] * min(square, cap)
    force = after * (ratio + cubic)
    tangent = ratio + cubic * (3.0 if square <= cap else 1.0)
    if yields:
        w[_MOVED + n] = after - here + min(max(here, -g), g)
        share = _yielding(w, n, w[_MOVED + n])
        end = w[Z + n] + w[_MOVED + n] * share
        force += (1.0 - ratio) * min(max(end, -w[YIELD + n]), w[YIELD + n])
        tangent += (1.0 - ratio) * share
    force *= w[STIFFNESS + n]
    tangent = w[STIFFNESS + n] * tangent if abs(there) >= g else 0.0
    dry = w[COULOMB + n] + w[_RISE + n]
    w[_G + n], w[_REST + n], w[_OIL + n] = _balance(
        w, n, w[_FQ + n], w[_FR + n], force, tangent, dry, w[_G + n]
    )


@njit(inline='always')
def _yield(w: Array, n: int) -> None:
    """Carry the hysteretic displacement z on over the step _G."""
    here, there, g = w[X + n], w[X + n] + w[_G + n], w[GAP + n]
    moved = there - min(max(there, -g), g) - here + min(max(here, -g), g)
    end = w[Z + n] + moved * _yielding(w, n, moved)
    w[Z + n] = min(max(end, -w[YIELD + n]), w[YIELD + n])


@njit(inline='always')
def _hardness(w: Array, n: int, z: float) -> Any:
    """|z/x_y|^n, interpolated between the powers 1, 2, 4, 8 and 16."""
    r = min(abs(z) * w[INVERSE_YIELD + n], 1.0)
    r2 = r * r
    r4 = r2 * r2
    r8 = r4 * r4
    low = w[SHARP_1 + n] * r + w[SHARP_2 + n] * r2 + w[SHARP_4 + n] * r4
    return low + w[SHARP_8 + n] * r8 + w[SHARP_16 + n] * r8 * r8


@njit(inline='always')
def _yielding(w: Array, n: int, moved: float) -> Any:
    """Mean dz/dx of the Bouc-Wen model over a step `moved` (midpoint rule)."""
    z = w[Z + n]
    hard = _hardness(w, n, z)
    middle = z + 0.5 * moved * (1.0 - hard if z * moved > 0.0 else 1.0)
    hard = _hardness(w, n, middle)
    return 1.0 - hard if middle * moved > 0.0 else 1.0


@njit
def advance(
    table: Array,
    on: NDArray[np.bool_],
    u: Array,
    offset: int,
    begin: int,
    substeps: int,
    period: float,
    linear: bool,
    displacement: Array,
    force: Array,
) -> None:
    """Write the sensed displacement at samples begin, begin+1, ... and carry the state on.

    Args:
        table: (SIZE,), read and updated; its states stand at sample begin - 1, or at sample 0
            where begin is 0.
        on: (SWITCHES,) which stages act.
        u: command samples [m]; u[0] is sample `offset` of the stream.
        offset: stream index of u[0].
        begin: stream index of the first sample written.
        substeps: sub-steps per sample.
        period: sample period [s].
        linear: whether the command runs linearly between samples (else zero-order hold).
        displacement: (n, LANES) output, recorded displacement before sensor post-steps [m].
        force: (n, LANES) output, actuator force [N]; (0, LANES) where it is not wanted.
    """
    w = np.empty(SIZE)  # known to the compiler
    w[:] = table
    inverse = 1.0 / substeps
    rate = 2.0 * substeps / period
    want_force = force.shape[0] > 0
    looks = 3 if on[ON_STRIBECK] else 2 if on[ON_GAP] else 1
    for i in range(displacement.shape[0]):
        at = begin + i - 1  # the interval from sample `at` to the sample written now
        for j in range(substeps if at >= 0 else 0):
            if on[ON_LAG]:
                for n in range(LANES):
                    clock = 1.0 - w[SKEW + n]
                    start = (at + j * inverse) * clock - w[LAG_SAMPLES + n]
                    mean, slope = _command(u, offset, start, start + clock * inverse, linear)
                    w[_U + n] = w[GAIN + n] * mean
                    w[_RAMP + n] = w[GAIN + n] * slope
            else:
                mean, slope = held(u, at - offset), 0.0
                if linear:
                    start = at + j * inverse
                    mean, slope = _command(u, offset, start, start + inverse, True)
                for n in range(LANES):
                    w[_U + n] = w[GAIN + n] * mean
                    w[_RAMP + n] = w[GAIN + n] * slope
            if not (on[ON_FLOW] or on[ON_CURVED]):  # one pass
                for n in range(LANES):
                    q, dq = _valve(w, n)
                    k, guess = w[STIFFNESS + n], w[DX + n]
                    f = k * (w[X + n] + guess)
                    dx, rest, oil = _balance(w, n, q, dq, f, k, w[COULOMB + n], guess)
                    _finish(w, n, rate, q, dq, dx, rest, oil)
                for n in range(LANES):
                    _chains(w, n)
            else:  # a pass for every stage that acts
                for n in range(LANES):
                    w[_QM + n], w[_QR + n] = _valve(w, n)
                    w[_FQ + n], w[_FR + n], w[_G + n] = w[_QM + n], w[_QR + n], w[DX + n]
                if on[ON_FLOW]:
                    _flow(w, on, (at + (j + 0.5) * inverse) * period)
                for _ in range(looks):
                    if on[ON_STRIBECK]:
                        for n in range(LANES):
                            w[_RISE + n] = _friction_rise(w, n)
                    if on[ON_YIELD]:
                        for n in range(LANES):
                            _look(w, n, True)
                    else:
                        for n in range(LANES):
                            _look(w, n, False)
                if on[ON_STRIBECK]:
                    for n in range(LANES):
                        w[LEVEL + n] = _friction_rise(w, n)
                if on[ON_YIELD]:
                    for n in range(LANES):
                        _yield(w, n)
                for n in range(LANES):
                    q, dq, dx = w[_QM + n], w[_QR + n], w[_G + n]
                    _finish(w, n, rate, q, dq, dx, w[_REST + n], w[_OIL + n])
                for n in range(LANES):
                    _chains(w, n)
            if on[ON_TRANSDUCER]:
                for n in range(LANES):
                    _transducer(w, n)
        if on[ON_TRANSDUCER]:
            for n in range(LANES):
                displacement[i, n] = w[SENSED + n]
        else:
            for n in range(LANES):
                displacement[i, n] = w[X + n] + w[X_EXACT + n] - w[X_TRAP + n]
        if want_force:
            for n in range(LANES):
                force[i, n] = w[F + n]
    table[:] = w
