"""Compiled stepping kernel of x'' + a1 x' + a0 x = b0 u: exact discretisation and stepping.

The difference equation is kept in increment (delta) form. With d[n] = y[n+1] - y[n],

    d[n] = decay d[n-1] - pull y[n] + g0 u[n+1] + g1 u[n] + g2 u[n-1],    y[n+1] = y[n] + d[n],

which is the usual second-order recursion with poles p1, p2, decay = p1 p2 and
pull = (1 - p1)(1 - p2). At high rates both poles are near one and `pull` is tiny: stored as a
number of its own it keeps full relative accuracy, where 1 - c1 - c2 of the direct form does not.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.records import Array

# Columns of the coefficient table of `discretise`.
DECAY, PULL, G0, G1, G2, START_X, START_V, START_U0, START_U1 = range(9)
COLUMNS = 9

# Rows of the lane table of `advance`: state, coefficients, sums; each row holds LANES thetas.
LANES = 32
_Y, _D, _DECAY, _PULL, _G0, _G1, _G2, _SUM, _SQUARES = range(9)

_TERMS = 16  # Taylor terms: arguments are scaled below 1/2, 2^-16/16! is far below rounding
_INVERSE_FACTORIAL = np.array([1.0 / math.factorial(n) for n in range(_TERMS + 3)])
_MAX_DOUBLINGS = 60  # beyond this the response is aliased 2^60 times: nothing left to compute


@njit
def equation_2a(theta: Array, stiffness: float) -> tuple[float, float, float, float]:
    """Return n0, d2, d1, d0 of x/u = n0 / (d2 s^2 + d1 s + d0) for one theta, shape (4,)."""
    b1, ab, a2, a3 = theta[0], theta[1], theta[2], theta[3]
    k = stiffness
    return ab, k + a2, a3 * k + b1 * k + b1 * a2, b1 * a3 * k + ab


@njit
def systems(theta: Array, stiffness: float) -> Array:
    """Return a1, a0, b0 of x'' + a1 x' + a0 x = b0 u for thetas (m, 4), shape (m, 3)."""
    out = np.empty((len(theta), 3))
    for i in range(len(theta)):
        n0, d2, d1, d0 = equation_2a(theta[i], stiffness)
        out[i, 0], out[i, 1], out[i, 2] = d1 / d2, d0 / d2, n0 / d2
    return out


@njit
def discretise_one(a1: float, a0: float, b0: float, period: float, foh: bool, out: Array) -> None:
    """Write the exact difference equation of one system into `out`, shape (COLUMNS,).

    The integrals of the transition matrix are divided differences of exp at (p1 T, p2 T, 0, 0).
    Their Taylor series in the elementary symmetric polynomials of the poles needs no roots, so
    real, equal and complex poles are one case; fast poles are met by halving the period and
    doubling the state back. Coefficients that do not exist (infinite a1, a0) come out as NaN.

    Args:
        a1: coefficient of velocity [1/s].
        a0: coefficient of position [1/s^2].
        b0: coefficient of the command [1/s^2].
        period: sample period [s].
        foh: command linear between its samples instead of held.
        out: receives the columns DECAY..START_U1.
    """
    size = max(abs(a1) * period, np.sqrt(abs(a0)) * period)
    doublings = 0
    while size > 0.5 and doublings < _MAX_DOUBLINGS:
        size *= 0.5
        doublings += 1
    if not size <= 0.5:
        out[:] = np.nan
        return
    T = period / 2.0**doublings
    e1, e2 = -a1 * T, a0 * T * T
    # h_n: complete homogeneous symmetric polynomials of the two scaled poles.
    h_old, h = 0.0, 1.0
    s1 = s2 = s3 = 0.0
    for n in range(_TERMS):
        s1 += h * _INVERSE_FACTORIAL[n + 1]  # exp[z1, z2]
        s2 += h * _INVERSE_FACTORIAL[n + 2]  # exp[z1, z2, 0]
        s3 += h * _INVERSE_FACTORIAL[n + 3]  # exp[z1, z2, 0, 0]
        h_old, h = h, e1 * h - e2 * h_old
    f12 = T * s1  # velocity -> position
    step = T * T * s2  # position after a unit step of acceleration
    ramp = T * T * T * s3  # its integral
    for _ in range(doublings):
        f11 = 1.0 - a0 * step
        f22 = f11 - a1 * f12
        ramp = (1.0 + f11) * ramp + (T + f12) * step
        step, f12 = step + f11 * step + f12 * f12, f12 * (f11 + f22)
        T *= 2.0
    f22 = 1.0 - a0 * step - a1 * f12
    x1 = v1 = 0.0  # of the next sample's command
    if foh:
        x1, v1 = ramp / period, step / period
    x0, v0 = step - x1, f12 - v1  # of this sample's command
    out[DECAY] = np.exp(-a1 * period)
    # Static gain is b0/a0, hence pull = a0/b0 (g0 + g1 + g2); free of the hold.
    out[PULL] = a0 * (step + f12 * f12 - f22 * step)
    out[G0] = b0 * x1
    out[G1] = b0 * (x0 - f22 * x1 + f12 * v1)
    out[G2] = b0 * (f12 * v0 - f22 * x0)
    out[START_X] = -a0 * step
    out[START_V] = f12
    out[START_U0] = b0 * x0
    out[START_U1] = b0 * x1


@njit
def discretise(systems: Array, period: float, foh: bool) -> Array:
    """Return the difference equations of systems (m, 3) = (a1, a0, b0), shape (m, COLUMNS)."""
    out = np.empty((len(systems), COLUMNS))
    for i in range(len(systems)):
        discretise_one(systems[i, 0], systems[i, 1], systems[i, 2], period, foh, out[i])
    return out


@njit
def start_increment(c: Array, x0: float, v0: float, u0: float, u1: float) -> float:
    """Return d[0] = y[1] - y[0] from initial position, velocity and the first two commands."""
    d: float = c[START_X] * x0 + c[START_V] * v0 + c[START_U0] * u0 + c[START_U1] * u1
    return d


# State of `stream`: samples seen (0, 1, 2 = more), y, d (velocity until the second sample), and
# the last two commands.
STREAM = 5


# Strict order of operations: the result must not depend on how a command is cut into blocks.
@njit(fastmath=False, nogil=True)
def stream(c: Array, state: Array, command: Array, out: Array) -> None:
    """Step one system through a block of commands, going on from `state`.

    Args:
        c: one row of `discretise`.
        state: shape (STREAM,), updated; (0, x0, v0, 0, 0) starts anew.
        command: shape (n,) [m].
        out: receives the displacement at the command's samples, shape (n,) [m].
    """
    seen, y, d, u1, u2 = state[0], state[1], state[2], state[3], state[4]
    for n in range(len(command)):
        u = command[n]
        if seen == 1.0:
            d = start_increment(c, y, d, u1, u)
            y += d
            seen = 2.0
        elif seen == 0.0:
            seen = 1.0
        else:
            d = c[DECAY] * d - c[PULL] * y + c[G0] * u + c[G1] * u1 + c[G2] * u2
            y += d
        out[n] = y
        u2, u1 = u1, u
    state[0], state[1], state[2], state[3], state[4] = seen, y, d, u1, u2


@njit(nogil=True)
def respond(
    table: Array, x0: float, v0: float, command: Array, first_out: int, out: Array
) -> None:
    """Step many systems through one command from one initial state.

    Args:
        table: `discretise` of every system, shape (m, COLUMNS).
        x0: initial position [m].
        v0: initial velocity [m/s].
        command: shape (n,) [m].
        first_out: samples before this one are stepped through, but not written.
        out: receives the displacements, shape (n - first_out, m) [m]: systems side by side, so
            that vector units step them together.
    """
    L, n = LANES, len(command)
    m = len(table)
    S, passed = np.zeros(9 * L), np.empty(4 * L)
    for first in range(0, m, L):
        width = min(L, m - first)
        for j in range(L):
            c = table[min(first + j, m - 1)]  # the last block is filled with copies
            S[_Y * L + j] = x0
            S[_D * L + j] = start_increment(c, x0, v0, command[0], command[min(1, n - 1)])
            for row in range(_DECAY, _G2 + 1):
                S[row * L + j] = c[row - _DECAY + DECAY]
        i = 0
        # Four samples per pass: loading and storing the lanes costs more than stepping them.
        while i + 5 < n:
            u0, u1, u2, u3, u4, u5 = (
                command[i],
                command[i + 1],
                command[i + 2],
                command[i + 3],
                command[i + 4],
                command[i + 5],
            )
            for j in range(L):
                y, d = S[_Y * L + j], S[_D * L + j]
                decay, pull = S[_DECAY * L + j], S[_PULL * L + j]
                g0, g1, g2 = S[_G0 * L + j], S[_G1 * L + j], S[_G2 * L + j]
                passed[j] = y
                y += d
                d = decay * d - pull * y + (g0 * u2 + g1 * u1 + g2 * u0)
                passed[L + j] = y
                y += d
                d = decay * d - pull * y + (g0 * u3 + g1 * u2 + g2 * u1)
                passed[2 * L + j] = y
                y += d
                d = decay * d - pull * y + (g0 * u4 + g1 * u3 + g2 * u2)
                passed[3 * L + j] = y
                y += d
                S[_Y * L + j] = y
                S[_D * L + j] = decay * d - pull * y + (g0 * u5 + g1 * u4 + g2 * u3)
            for k in range(4):
                if i + k >= first_out:
                    for j in range(width):
                        out[i + k - first_out, first + j] = passed[k * L + j]
            i += 4
        while i < n:
            u0, u1, u2 = command[i], command[min(i + 1, n - 1)], command[min(i + 2, n - 1)]
            if i >= first_out:
                for j in range(width):
                    out[i - first_out, first + j] = S[_Y * L + j]
            for j in range(L):
                y = S[_Y * L + j] + S[_D * L + j]
                S[_Y * L + j] = y
                S[_D * L + j] = (
                    S[_DECAY * L + j] * S[_D * L + j]
                    - S[_PULL * L + j] * y
                    + (S[_G0 * L + j] * u2 + S[_G1 * L + j] * u1 + S[_G2 * L + j] * u0)
                )
            i += 1


@njit
def _advance(S: Array, measured: Array, padded: Array, start: int, stop: int, foh: bool) -> None:
    """Step all lanes through samples start:stop, adding errors and their squares to the sums.

    Four samples are taken per pass over the lanes, so that a lane's state and coefficients stay
    in vector registers for four steps; the loop over lanes is the one that is vectorised.
    """
    L = LANES
    n = start
    while n + 4 <= stop:
        m0, m1, m2, m3 = measured[n], measured[n + 1], measured[n + 2], measured[n + 3]
        u0, u1, u2 = padded[n], padded[n + 1], padded[n + 2]
        u3, u4, u5 = padded[n + 3], padded[n + 4], padded[n + 5]
        for j in range(L):
            y, d = S[_Y * L + j], S[_D * L + j]
            decay, pull = S[_DECAY * L + j], S[_PULL * L + j]
            g0, g1, g2 = S[_G0 * L + j], S[_G1 * L + j], S[_G2 * L + j]
            e0 = m0 - y
            y += d
            d = decay * d - pull * y + (g1 * u1 + g2 * u0)
            if foh:
                d += g0 * u2
            e1 = m1 - y
            y += d
            d = decay * d - pull * y + (g1 * u2 + g2 * u1)
            if foh:
                d += g0 * u3
            e2 = m2 - y
            y += d
            d = decay * d - pull * y + (g1 * u3 + g2 * u2)
            if foh:
                d += g0 * u4
            e3 = m3 - y
            y += d
            d = decay * d - pull * y + (g1 * u4 + g2 * u3)
            if foh:
                d += g0 * u5
            S[_Y * L + j] = y
            S[_D * L + j] = d
            S[_SUM * L + j] += (e0 + e1) + (e2 + e3)
            S[_SQUARES * L + j] += (e0 * e0 + e1 * e1) + (e2 * e2 + e3 * e3)
        n += 4
    while n < stop:
        for j in range(L):
            y, d = S[_Y * L + j], S[_D * L + j]
            e = measured[n] - y
            y += d
            S[_Y * L + j] = y
            S[_D * L + j] = (
                S[_DECAY * L + j] * d
                - S[_PULL * L + j] * y
                + S[_G0 * L + j] * padded[n + 2]
                + S[_G1 * L + j] * padded[n + 1]
                + S[_G2 * L + j] * padded[n]
            )
            S[_SUM * L + j] += e
            S[_SQUARES * L + j] += e * e
        n += 1


@njit(nogil=True)
def error_sums(
    table: Array,
    starts: Array,
    measured: Array,
    padded: Array,
    settle: int,
    foh: bool,
    out: Array,
) -> None:
    """Write (sum of e, sum of e^2) of e = measured - y over samples settle..n into `out`.

    Args:
        table: `discretise` of every theta, shape (m, COLUMNS).
        starts: initial position and velocity, shape (2,) [m, m/s].
        measured: shape (n,) [m].
        padded: command with two samples appended, shape (n + 2,) [m].
        settle: samples at the beginning that are simulated but not counted.
        foh: whether g0 is in use.
        out: shape (m, 2) [m, m^2].
    """
    L = LANES
    m = len(table)
    S = np.zeros(9 * L)
    for first in range(0, m, L):
        for j in range(L):
            c = table[min(first + j, m - 1)]  # the last block is filled with copies
            S[_Y * L + j] = starts[0]
            S[_D * L + j] = start_increment(c, starts[0], starts[1], padded[0], padded[1])
            for row in range(_DECAY, _G2 + 1):
                S[row * L + j] = c[row - _DECAY + DECAY]
        _advance(S, measured, padded, 0, settle, foh)
        S[_SUM * L :] = 0.0
        _advance(S, measured, padded, settle, len(measured), foh)
        for j in range(min(L, m - first)):
            out[first + j, 0] = S[_SUM * L + j]
            out[first + j, 1] = S[_SQUARES * L + j]
