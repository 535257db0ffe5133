"""Stepping of many systems x'' + a1 x' + a0 x = b0 u side by side: responses and error sums."""

from __future__ import annotations

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model.kernel import DECAY, start_increment
from actuator_glue.records import Array

# Rows of the lane table of `_advance`: state, coefficients, sums; each row holds LANES thetas.
LANES = 32
_Y, _D, _DECAY, _PULL, _G0, _G1, _G2, _SUM, _SQUARES = range(9)


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
