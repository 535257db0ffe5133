"""The second generator's plant: every effect written another way than in plant.py.

One implicit step for everything: over a step h the piston velocity v solves

    spring(x + g v) + friction(v) + c(v) v + m (v - v_0)/g = p
    p = f + g (Q - alpha_2 v - alpha_3 p)

with g = h/2, or h where friction without an inertia would ring: a monotone scalar equation
(Newton, bisected where it leaves its bracket). The valve is stepped by the midpoint rule, with the
control error in the middle of the step: that of its beginning is a delay of h/2, 16 us at 32 kHz,
which alone moves beta_1 by up to four standard deviations of what two records tell.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from sizing import FINE

RATE = 256.0
SUBSTEPS = 128
_EVERY = SUBSTEPS // FINE

# Names and neutral values; forms (0, 1, 2) choose between ways to write an effect.
NEUTRAL = {
    'delay': 0.0,  # s
    'amplitude_delay': 0.0,  # s at 2 mm of command
    'command_gain': 1.0,
    'rate_gain': 0.0,  # s/m
    'command_play': 0.0,  # m, half width
    'loop_play': 0.0,  # m, half width of play before the controller's own transducer
    'integral': 0.0,  # 1/s, integral action of the controller
    'valve_lag': 0.0,  # s
    'deadband': 0.0,  # m
    'deadband_form': 0.0,  # 0 hard, 1 smooth overlap, 2 a tenth of the slope inside
    'valve_play': 0.0,  # m, hysteresis of the spool
    'null': 0.0,  # m
    'max_flow': 0.0,  # N/s
    'saturation_form': 0.0,  # 0 hard, 1 smooth, 2 spool stop before the valve's lag
    'supply_force': 0.0,  # N
    'asymmetry': 0.0,
    'position_gain': 0.0,
    'droop': 0.0,
    'droop_form': 0.0,  # 0 square root of filtered flow, 1 accumulator refilled at a fixed rate
    'droop_flow': 1.0,
    'droop_time': 1.0,
    'gain_drift': 0.0,  # over 60 s
    'drift_form': 0.0,  # 0 linear, 1 exponential (warm-up)
    'coulomb': 0.0,  # N
    'friction_form': 0.0,  # 0 tanh(v/1 mm/s), 1 LuGre (presliding 5 um)
    'stribeck': 0.0,  # N above coulomb
    'stribeck_speed': 1e-2,
    'support_stick': 0.0,  # N, dry friction that acts with the specimen only
    'viscous': 0.0,
    'return_damping': 0.0,  # damping that acts in one direction only
    'mass': 0.0,
    'gap': 0.0,
    'hardening': 0.0,  # 1/m^2
    'yield_x': 0.0,
    'yield_ratio': 1.0,
    'yield_power': 1.0,
    'yield_gamma': 0.5,  # gamma share of the Bouc-Wen loop, beta = 1 - gamma
    'loosening': 0.0,  # share of the flow gain lost at once
    'loosening_at': 1e9,  # s
    'command_lag': 0.0,  # s, low-pass in front of the controller
    'command_rate': 0.0,  # s/m, one over the fastest command
    'loop_lag': 0.0,  # s, pole of the controller's own transducer
    'turbulent_leak': 0.0,  # N^0.5/s, leakage as through an orifice
    'frame_compliance': 0.0,  # m/N, of the frame that holds the cylinder
    'frame_speed': 1.0,  # rad/s
    'frame_damping': 0.0,
    'frame_seen': 0.0,  # share of its motion that the recorded transducer sees
}
INDEX = {name: i for i, name in enumerate(NEUTRAL)}
(
    DELAY, AMPLITUDE_DELAY, GAIN, RATE_GAIN, COMMAND_PLAY, LOOP_PLAY, INTEGRAL, VALVE_LAG,
    DEADBAND, DEADBAND_FORM, VALVE_PLAY, NULL, MAX_FLOW, SATURATION_FORM, SUPPLY, ASYMMETRY,
    POSITION_GAIN, DROOP, DROOP_FORM, DROOP_FLOW, DROOP_TIME, GAIN_DRIFT, DRIFT_FORM, COULOMB,
    FRICTION_FORM, STRIBECK, STRIBECK_SPEED, SUPPORT_STICK, VISCOUS, RETURN_DAMPING, MASS, GAP,
    HARDENING, YIELD_X, YIELD_RATIO, YIELD_POWER, YIELD_GAMMA, LOOSENING, LOOSENING_AT,
    COMMAND_LAG, COMMAND_RATE, LOOP_LAG, TURBULENT_LEAK, FRAME, FRAME_SPEED, FRAME_DAMPING,
    FRAME_SEEN,
) = range(len(NEUTRAL))  # fmt: skip
_SLIP = 1e-3  # m/s
_PRESLIDING = 5e-6  # m


@njit(cache=True)
def _play(w, x, half):
    return min(max(w, x - half), x + half)


@njit(cache=True)
def _overlap(error, width, form):
    if form == 1.0:
        return error * (1.0 - math.exp(-((error / width) ** 2)))
    inner = min(max(error, -width), width)
    return error - inner + (0.1 * inner if form == 2.0 else 0.0)


@njit(cache=True)
def _orifice(q, f, x, s, t, e):
    """Flow into the cylinder of spool flow q."""
    out = q
    if e[ASYMMETRY] != 0.0:
        out *= 1.0 + e[ASYMMETRY] * (1.0 if q > 0.0 else -1.0)
    if e[POSITION_GAIN] != 0.0:
        out *= 1.0 + e[POSITION_GAIN] * (x / 2e-3) ** 2
    if e[GAIN_DRIFT] != 0.0:
        # Warm oil changes the orifice, not the valve's electronics.
        late = t / 60.0 if e[DRIFT_FORM] == 0.0 else 1.0 - math.exp(-t / 25.0)
        out *= 1.0 + e[GAIN_DRIFT] * late
    if t > e[LOOSENING_AT]:
        out *= 1.0 - e[LOOSENING]
    if e[DROOP] != 0.0:
        if e[DROOP_FORM] == 0.0:
            out *= math.sqrt(max(0.0, 1.0 - e[DROOP] * s))
        else:
            out *= 1.0 - e[DROOP] * s
    if e[SUPPLY] > 0.0:
        out *= math.sqrt(max(0.0, 1.0 - math.copysign(1.0, out) * f / e[SUPPLY]))
    if e[MAX_FLOW] > 0.0:
        if e[SATURATION_FORM] == 0.0:
            out = min(max(out, -e[MAX_FLOW]), e[MAX_FLOW])
        elif e[SATURATION_FORM] == 1.0:
            out /= (1.0 + (out / e[MAX_FLOW]) ** 12) ** (1.0 / 12.0)
    return out


@njit(cache=True)
def _specimen(x, z, k, e):
    """Force and tangent of the specimen."""
    ratio = e[YIELD_RATIO]
    if e[GAP] > 0.0:
        # Contact over a micrometre, no corner.
        a, b = (x - e[GAP]) / 1e-6, (-x - e[GAP]) / 1e-6
        push = 1e-6 * (max(a, 0.0) + math.log1p(math.exp(-abs(a))))
        pull = 1e-6 * (max(b, 0.0) + math.log1p(math.exp(-abs(b))))
        slope = 1.0 / (1.0 + math.exp(min(max(-a, -40.0), 40.0)))
        slope += 1.0 / (1.0 + math.exp(min(max(-b, -40.0), 40.0)))
        return k * (push - pull), k * slope
    cubic = e[HARDENING] * x * x
    return k * (ratio * x * (1.0 + cubic) + (1.0 - ratio) * z), k * ratio * (1.0 + 3.0 * cubic)


@njit(cache=True)
def _dry(v, w, limit, form, h):
    """Dry friction at v, its slope, and the bristle's next deflection."""
    if form == 0.0:
        r = math.tanh(v / _SLIP)
        return limit * r, limit * (1.0 - r * r) / _SLIP, w
    # LuGre bristle, implicit in its deflection: w' = v - |v| w / presliding.
    after = (w + h * v) / (1.0 + h * abs(v) / _PRESLIDING)
    slope = h / (1.0 + h * abs(v) / _PRESLIDING) ** 2
    return limit * after / _PRESLIDING, limit * slope / _PRESLIDING, after


@njit(cache=True)
def respond(command, theta, k, first_e, later_e, onset):
    """Piston displacement `FINE` times in each sample of a held command (n,) [m], from rest.

    The effects of `first_e` act until `onset` [s], those of `later_e` from then on.
    """
    n = command.shape[0]
    h = 1.0 / (RATE * SUBSTEPS)
    b1, n0, a2, a3 = theta[0], theta[1], theta[2], theta[3]
    q = q2 = f = x = v = z = w = s = total = 0.0
    felt = uplay = vplay = ulag = urate = frame = frame_v = 0.0
    out = np.empty(n * FINE)
    for i in range(n):
        e = first_e if i / RATE < onset else later_e
        dry = e[COULOMB] + e[STRIBECK] + (e[SUPPORT_STICK] if k > 0.0 else 0.0)
        heavy = e[MASS] > 0.0
        g = h if dry > 0.0 and not heavy else 0.5 * h
        leaky = 1.0 + g * a3
        oil = g * a2 / leaky
        for j in range(SUBSTEPS):
            if j % _EVERY == 0:
                out[i * FINE + j // _EVERY] = x + e[FRAME_SEEN] * frame
            t = (i + j / SUBSTEPS) / RATE
            lag = e[DELAY] + e[AMPLITUDE_DELAY] * abs(command[i]) / 2e-3
            late = i + j / SUBSTEPS - lag * RATE + 1e-9
            at = math.floor(late)
            u = command[at] if at >= 0 else 0.0
            # The mean over the step, where the next sample arrives within it.
            held = (at + 1 - late) * SUBSTEPS
            if held < 1.0 and -1 <= at < n - 1:
                u = held * u + (1.0 - held) * command[at + 1]
            if e[RATE_GAIN] != 0.0 and at > 0:
                u *= 1.0 + e[RATE_GAIN] * abs(command[at] - command[at - 1]) * RATE
            u *= e[GAIN]
            if e[COMMAND_RATE] > 0.0:
                most = h / e[COMMAND_RATE]
                before = urate
                urate = min(max(u, urate - most), urate + most)
                u = 0.5 * (before + urate)
            if e[COMMAND_LAG] > 0.0:
                before = ulag
                ulag += (u - ulag) * (1.0 - math.exp(-h / e[COMMAND_LAG]))
                u = 0.5 * (before + ulag)
            uplay = _play(uplay, u, e[COMMAND_PLAY])
            read = _play(felt, x + frame + 0.5 * h * (v + frame_v), e[LOOP_PLAY])
            if e[LOOP_LAG] > 0.0:
                read = felt + (read - felt) * (1.0 - math.exp(-h / e[LOOP_LAG]))
            felt = read
            error = uplay - felt + e[NULL]
            total += h * error
            error += e[INTEGRAL] * (total - 0.5 * h * error)
            # From where a held command has leapt to as the step begins.
            vplay = _play(vplay, error + 0.5 * h * (v + frame_v), e[VALVE_PLAY])
            vplay = _play(vplay, error, e[VALVE_PLAY])
            error = vplay
            if e[DEADBAND] > 0.0:
                error = _overlap(error, e[DEADBAND], e[DEADBAND_FORM])
            if e[SATURATION_FORM] == 2.0 and e[MAX_FLOW] > 0.0:
                stop = e[MAX_FLOW] * b1 / n0
                error = min(max(error, -stop), stop)
            drive = error
            if e[VALVE_LAG] > 0.0:
                before = q2
                q2 += (error - q2) * (1.0 - math.exp(-h / e[VALVE_LAG]))
                drive = 0.5 * (before + q2)
            first = -b1 * q + n0 * drive
            middle = q + 0.5 * h * first
            q += h * (-b1 * middle + n0 * drive)
            flow = _orifice(middle, f, x, s, t, e)
            if e[DROOP] != 0.0:
                if e[DROOP_FORM] == 0.0:
                    s += h * (abs(flow) / e[DROOP_FLOW] - s) / e[DROOP_TIME]
                else:  # emptied by flow, refilled at a fixed rate, never overfull
                    s += h * (abs(flow) / e[DROOP_FLOW] - 0.4) / e[DROOP_TIME]
                    s = min(max(s, 0.0), 1.5)
            pull = (f + g * (flow - a2 * frame_v)) / leaky
            if e[TURBULENT_LEAK] > 0.0:
                pull -= g * math.copysign(e[TURBULENT_LEAK] * math.sqrt(abs(f)), f)
            limit = e[COULOMB] + e[STRIBECK] * math.exp(-abs(v) / e[STRIBECK_SPEED])
            if k > 0.0:
                limit += e[SUPPORT_STICK]
            hard = 1.0
            if e[YIELD_X] > 0.0:
                size = min(abs(z) / e[YIELD_X], 1.0) ** e[YIELD_POWER]
                sign = 1.0 if z * v > 0.0 else -1.0
                hard = 1.0 - size * ((1.0 - e[YIELD_GAMMA]) * sign + e[YIELD_GAMMA])
            zk = k * (1.0 - e[YIELD_RATIO]) * hard * g
            guess, low, high, after = v, -10.0, 10.0, w
            for _ in range(40):
                spring, tangent = _specimen(x + g * guess, z, k, e)
                damping = e[VISCOUS] + (e[RETURN_DAMPING] if guess < 0.0 else 0.0)
                rest = spring + zk * guess + damping * guess + oil * guess - pull
                slope = tangent * g + zk + damping + oil
                if heavy:
                    rest += e[MASS] * (guess - v) / g
                    slope += e[MASS] / g
                if dry > 0.0:
                    force, rise, after = _dry(guess, w, limit, e[FRICTION_FORM], h)
                    rest += force
                    slope += rise
                if rest > 0.0:
                    high = guess
                else:
                    low = guess
                step = rest / slope
                if abs(step) < 1e-12 + 1e-9 * abs(guess):
                    break
                guess -= step
                if not low < guess < high:
                    guess = 0.5 * (low + high)
            w = after
            x += h * guess
            z += h * guess * hard
            # On from the point that was solved for to the end of the step. What pushes a spring
            # alone is that spring's force: without one, in a gap, it would ring for ever.
            f += (pull - oil * guess - f) * h / g
            if dry == 0.0 and not heavy and e[VISCOUS] + e[RETURN_DAMPING] == 0.0:
                f = _specimen(x, z, k, e)[0]
            v = 2.0 * guess - v if heavy else guess
            if e[FRAME] > 0.0:
                # The cylinder gives way to what it pushes the piston with.
                w2 = e[FRAME_SPEED] ** 2
                frame_v += h * w2 * (e[FRAME] * f - frame)
                frame_v /= 1.0 + 2.0 * h * e[FRAME_DAMPING] * e[FRAME_SPEED]
                frame += h * frame_v
        if not -1.0 < x < 1.0:
            out[i * FINE :] = np.nan
            break
    return out


@njit(cache=True)
def play(x, half):
    """Play operator of half width [m] along x (n,)."""
    out = np.empty_like(x)
    w = 0.0
    for i in range(x.shape[0]):
        w = _play(w, x[i], half)
        out[i] = w
    return out
