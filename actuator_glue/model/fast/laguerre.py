"""Compiled expansion of Eq. (2) in Laguerre sections of two poles that take turns.

The terms of one system and the bound of those that follow; with equal poles these are Laguerre
functions. Derivation: docs/fast_path.md, sections 2 and 5.
"""

from __future__ import annotations

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model import kernel
from actuator_glue.records import Array

BLOCK = 8  # terms that stand together; where there are two banks, their blocks take turns
TAIL = BLOCK  # terms beyond the basis that are summed one by one for the truncation bound

# One row per record: numbers, then reference coefficients, column sums, cross products, Gram.
(TERMS, FREE, STIFFNESS, PERIOD, FOH, POLE, DELTA, POLE_2, DELTA_2, SHIFT) = range(10)
X0, V0, U0, NORM, COUNT, SUM, SQUARES, BEYOND = range(10, 18)
HEADER = 3 * BLOCK  # what follows is aligned as the row is: a fifth faster
START = 13  # numbers that start an expansion, see `expand`


@njit
def _numerator(n0: float, n1: float, n2: float, pole: float, delta: float) -> tuple[float, ...]:
    """Return n0 + n1 w + n2 w^2 times (zeta + pole)^2, w = z - 1, in powers of zeta."""
    d2 = delta * delta
    return (
        n0 * pole * pole + n1 * delta * pole + n2 * d2,
        2.0 * n0 * pole + n1 * d2 - 2.0 * n2 * d2,
        n0 - n1 * delta + n2 * d2,
    )


@njit
def _first_terms(
    n: tuple[float, ...], r1: float, r2: float, shift: float, scale: float, out: Array
) -> None:
    """Write the first five terms, (5,), by division: see docs/fast_path.md, section 2.

    Args:
        n: numerator in powers of zeta.
        r1: of the denominator 1 + r1 zeta + r2 zeta^2.
        r2: likewise.
        shift: b of the second section (zeta + b)/(1 + b zeta).
        scale: of the numerator.
        out: receives them.
    """
    at_shift = 1.0 - shift * r1 + shift * shift * r2
    out[0] = n[0] * scale
    p0, p1 = n[1] * scale - out[0] * r1, n[2] * scale - out[0] * r2
    for k in (1, 3):
        out[k] = (p0 - shift * p1) / at_shift
        m1 = -out[k] * r2
        m0 = p1 - out[k] * r1 - shift * m1
        out[k + 1] = m0
        p0, p1 = m1 + shift * m0 - m0 * r1, shift * m1 - m0 * r2


@njit
def expand(c: Array, t: Array, start: Array) -> None:
    """Write what starts the expansion of one system: sum and product of lambda, terms, radius.

    Args:
        c: one row of `kernel.discretise`.
        t: the record's row.
        start: shape (START,): s, p of the recursion c[k] = s c[k-2] - p c[k-4], first five terms
            for the command and for the initial state, largest modulus of its two roots.
    """
    pole, delta, shift = t[POLE], t[DELTA], t[SHIFT]
    q0 = c[kernel.PULL]
    q1 = (1.0 - c[kernel.DECAY]) + q0
    d0, d1, d2 = _numerator(q0, q1, 1.0, pole, delta)
    r1, r2 = d1 / d0, d2 / d0
    g0, g1, g2 = c[kernel.G0], c[kernel.G1], c[kernel.G2]
    command = _numerator(g0 + g1 + g2, 2.0 * g0 + g1, g0, pole, delta)
    # What a start other than from rest, or a first-order hold that does not start at zero, adds:
    # the response to one impulse at the first sample.
    x0 = t[X0] - g0 * t[U0]
    h = (
        (c[kernel.START_X] - c[kernel.DECAY] + q0) * t[X0]
        + c[kernel.START_V] * t[V0]
        + (c[kernel.START_U0] - g1) * t[U0]
    )
    free = _numerator(x0 + h, 2.0 * x0 + h, x0, pole, delta)
    both = 1.0 - shift * r1 + shift * shift * r2
    total = (r1 * r1 - 2.0 * r2 - shift * r1 * (1.0 + r2) + 2.0 * shift * shift * r2) / both
    product = r2 * (r2 - shift * r1 + shift * shift) / both
    start[0], start[1] = total, product
    _first_terms(command, r1, r2, shift, 1.0 / d0, start[2:7])
    _first_terms(free, r1, r2, shift, 1.0 / d0, start[7:12])
    root = total * total - 4.0 * product
    start[12] = 0.5 * (abs(total) + np.sqrt(root)) if root > 0.0 else np.sqrt(abs(product))


@njit
def _beyond(radius: float, last: float, before: float) -> float:
    """Bound the sum of the moduli of all terms after `last`, which follows `before`.

    With both roots of their recursion within radius r, |c[k+n]| <= (n+1) r^n |c[k]| + n r^(n+1)
    |c[k-1]|.
    """
    if not radius < 1.0:
        return np.inf
    full = 1.0 / (1.0 - radius) ** 2
    return abs(last) * (full - 1.0) + abs(before) * radius * radius * full


@njit
def series(start: Array, bank: int, banks: int, z: Array) -> float:
    """Write all terms of one system and bank into z; bound the sum of those that follow.

    The first two blocks by the recursion that every second term obeys, whole blocks from there on
    by that of every eighth (the same roots to the fourth power).

    Args:
        start: as written by `expand`.
        bank: 0 for the command's terms, 1 for the initial state's.
        banks: how many there are; their blocks take turns.
        z: shape (blocks, BLOCK).
    """
    t2, d2 = start[0], start[1]
    t4, d4 = t2 * t2 - 2.0 * d2, d2 * d2
    t8, d8 = t4 * t4 - 2.0 * d4, d4 * d4
    k0 = 2 + 5 * bank
    for k in range(5):
        z[bank, k] = start[k0 + k]
    c1, c2, c3, c4 = start[k0 + 1], start[k0 + 2], start[k0 + 3], start[k0 + 4]
    # Two by two: neither waits for the other.
    for k in range(5, 2 * BLOCK, 2):
        c1, c3 = c3, t2 * c3 - d2 * c1
        c2, c4 = c4, t2 * c4 - d2 * c2
        z[bank + banks * (k // BLOCK), k % BLOCK] = c3
        if k < 2 * BLOCK - 1:
            z[bank + banks * ((k + 1) // BLOCK), (k + 1) % BLOCK] = c4
    for row in range(2 * banks + bank, len(z), banks):
        for i in range(BLOCK):
            z[row, i] = t8 * z[row - banks, i] - d8 * z[row - 2 * banks, i]
        if row < 3 * banks:  # the recursion does not hold for the very first term
            z[row, 0] = c4
    last = z[len(z) - banks + bank]
    return _beyond(start[12], last[BLOCK - 1], last[BLOCK - 3]) + _beyond(
        start[12], last[BLOCK - 2], last[BLOCK - 4]
    )
