"""Compiled Laguerre expansion of Eq. (2): terms of one system and the bound of those that follow.

Derivation: docs/fast_path.md, sections 2 and 5. `delta` is 1 - `pole` wherever both are passed.
"""

from __future__ import annotations

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model import kernel
from actuator_glue.records import Array

BLOCK = 8  # terms that stand together; where there are two banks, their blocks take turns
TAIL = 2 * BLOCK  # terms beyond the basis that are summed one by one for the truncation bound

# One row per record: numbers, then reference coefficients, column sums, cross products, Gram.
(TERMS, FREE, STIFFNESS, PERIOD, FOH, POLE, DELTA, X0, V0, U0) = range(10)
NORM, COUNT, SUM, SQUARES, BEYOND = range(10, 15)
HEADER = 2 * BLOCK  # what follows is aligned as the row is: a fifth faster


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
    n: tuple[float, ...], r1: float, r2: float, scale: float
) -> tuple[float, float, float]:
    c0 = n[0] * scale
    c1 = n[1] * scale - r1 * c0
    return c0, c1, n[2] * scale - r1 * c1 - r2 * c0


@njit
def expand(c: Array, t: Array, start: Array) -> None:
    """Write what starts the expansion of one system: r1, r2, three terms each, radius.

    Args:
        c: one row of `kernel.discretise`.
        t: the record's row.
        start: shape (9,): ratios of the recursion c[k] = -r1 c[k-1] - r2 c[k-2], first terms for
            the command and for the initial state, largest modulus of zeta's inverse poles.
    """
    pole, delta = t[POLE], t[DELTA]
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
    start[0], start[1] = r1, r2
    start[2], start[3], start[4] = _first_terms(command, r1, r2, 1.0 / d0)
    start[5], start[6], start[7] = _first_terms(free, r1, r2, 1.0 / d0)
    root = r1 * r1 - 4.0 * r2
    start[8] = 0.5 * (abs(r1) + np.sqrt(root)) if root > 0.0 else np.sqrt(abs(r2))


@njit
def _beyond(radius: float, last: float, before: float) -> float:
    """Bound the sum of the moduli of all terms after `last`, which follows `before`.

    With both inverse poles within radius r, |c[k+n]| <= (n+1) r^n |c[k]| + n r^(n+1) |c[k-1]|.
    """
    if not radius < 1.0:
        return np.inf
    full = 1.0 / (1.0 - radius) ** 2
    return abs(last) * (full - 1.0) + abs(before) * radius * radius * full


@njit
def series(start: Array, bank: int, banks: int, z: Array) -> float:
    """Write all terms of one system and bank into z; bound the sum of those that follow.

    The first two blocks by the recursion that every second term obeys (its poles are the squares),
    whole blocks from there on by that of every eighth.

    Args:
        start: as written by `expand`.
        bank: 0 for the command's terms, 1 for the initial state's.
        banks: how many there are; their blocks take turns.
        z: shape (blocks, BLOCK).
    """
    r1, r2 = start[0], start[1]
    t2, d2 = r1 * r1 - 2.0 * r2, r2 * r2
    t4, d4 = t2 * t2 - 2.0 * d2, d2 * d2
    t8, d8 = t4 * t4 - 2.0 * d4, d4 * d4
    k0 = 2 + 3 * bank
    c1, c2 = start[k0 + 1], start[k0 + 2]
    z[bank, 0], z[bank, 1], z[bank, 2] = start[k0], c1, c2
    c3 = -r1 * c2 - r2 * c1
    c4 = -r1 * c3 - r2 * c2
    z[bank, 3], z[bank, 4] = c3, c4
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
    row = len(z) - banks + bank
    return _beyond(start[8], z[row, BLOCK - 1], z[row, BLOCK - 2])
