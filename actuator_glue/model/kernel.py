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
