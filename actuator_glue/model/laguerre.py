"""Compiled pieces of the fast likelihood: Laguerre expansion, its Gram matrix, the quadratic form.

Derivation and error bound: docs/fast_path.md. `delta` is 1 - `pole` wherever both are passed.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model import kernel
from actuator_glue.records import Array

Flags: TypeAlias = NDArray[np.bool_]

BLOCK = 8  # terms that stand together; where there are two banks, their blocks take turns
TAIL = 2 * BLOCK  # terms beyond the basis that are summed one by one for the truncation bound
_SAMPLES = 256  # samples per pass of the filter bank: the bank's outputs stay in the cache
_ROUNDING = 1e-15  # of the quadratic form, relative to the largest of what it adds up

# One row per record: numbers, then reference coefficients, column sums, cross products, Gram.
(TERMS, FREE, STIFFNESS, PERIOD, FOH, POLE, DELTA, X0, V0, U0) = range(10)
NORM, COUNT, SUM, SQUARES, BEYOND = range(10, 15)
HEADER = 15


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
def _series(start: Array, banks: int, weight: float, z: Array) -> float:
    """Write all terms of one system into z and bound the sum of those that follow.

    Terms one by one as far as block two; from there on whole blocks at once, by the recursion
    that every eighth term obeys (its poles are the eighth powers).

    Args:
        start: as written by `expand`.
        banks: 1, or 2 where the initial state has terms of its own.
        weight: of the command's terms in the bound; the initial state's have weight one.
        z: shape (blocks, BLOCK); blocks of both banks take turns.
    """
    r1, r2, d4 = start[0], start[1], start[1] ** 4
    t4 = (r1 * r1 - 2.0 * r2) ** 2 - 2.0 * r2 * r2
    t8, d8 = t4 * t4 - 2.0 * d4, d4 * d4
    beyond = 0.0
    for bank in range(banks):
        k0 = 2 + 3 * bank
        z[bank, 0], z[bank, 1], z[bank, 2] = start[k0], start[k0 + 1], start[k0 + 2]
        before, last = start[k0 + 1], start[k0 + 2]
        for i in range(3, BLOCK):
            before, last = last, -r1 * last - r2 * before
            z[bank, i] = last
        for i in range(BLOCK):
            before, last = last, -r1 * last - r2 * before
            z[banks + bank, i] = last
        for row in range(2 * banks + bank, len(z), banks):
            for i in range(BLOCK):
                z[row, i] = t8 * z[row - banks, i] - d8 * z[row - 2 * banks, i]
            if row < 3 * banks:  # the recursion does not hold for the very first term
                z[row, 0] = -r1 * last - r2 * before
        row = len(z) - banks + bank
        beyond += (1.0 if bank else weight) * _beyond(
            start[8], z[row, BLOCK - 1], z[row, BLOCK - 2]
        )
    return beyond


@njit
def _filter_bank(
    x: Array, size: int, banks: int, memory: Array, pole: float, delta: float
) -> None:
    """Fill each bank's rows of x with its first one passed through (1 - pole z)/(z - pole).

    Written as zeta = delta (z + 1)/(z - pole) - 1, which loses nothing when the pole is near one.
    `memory` (rows, 2) holds each section's last input and low-pass output across blocks.
    """
    for row in range(len(x)):
        if row < banks * BLOCK and row % BLOCK == 0:
            continue  # the inputs themselves
        source = row - 1 if row % BLOCK else row - 1 - (banks - 1) * BLOCK
        before, low = memory[row, 0], memory[row, 1]
        for n in range(size):
            new = x[source, n]
            low = pole * low + delta * (new + before)
            x[row, n] = low - new
            before = new
        memory[row, 0], memory[row, 1] = before, low


@njit
def _add_products(x: Array, size: int, e: Array, sums: Array, cross: Array, gram: Array) -> None:
    """Add row sums, products with e and the lower triangle of x x' of one block.

    Rows are taken four by two, so that each number read from the cache is used twice or more;
    `gram` (dims, dims) is filled a little beyond its triangle.
    """
    for i in range(0, len(x), 4):
        a, b, c, d = x[i], x[i + 1], x[i + 2], x[i + 3]
        for j in range(0, i + 4, 2):
            f, g = x[j], x[j + 1]
            af = ag = bf = bg = cf = cg = df = dg = 0.0
            for n in range(size):
                af += a[n] * f[n]
                ag += a[n] * g[n]
                bf += b[n] * f[n]
                bg += b[n] * g[n]
                cf += c[n] * f[n]
                cg += c[n] * g[n]
                df += d[n] * f[n]
                dg += d[n] * g[n]
            gram[i, j] += af
            gram[i, j + 1] += ag
            gram[i + 1, j] += bf
            gram[i + 1, j + 1] += bg
            gram[i + 2, j] += cf
            gram[i + 2, j + 1] += cg
            gram[i + 3, j] += df
            gram[i + 3, j + 1] += dg
    for i in range(len(x)):
        total = product = 0.0
        for n in range(size):
            total += x[i, n]
            product += x[i, n] * e[n]
        sums[i] += total
        cross[i] += product


@njit
def prepare(t: Array, c: Array, measured: Array, command: Array, settle: int) -> None:
    """Fill a record's row behind its header: everything that depends on its samples.

    Args:
        t: row with TERMS..U0 set.
        c: `kernel.discretise` of the reference system.
        measured: shape (n,) [m].
        command: shape (n,) [m].
        settle: samples at the beginning that are filtered but not counted.
    """
    K, banks = int(t[TERMS]), 1 + int(t[FREE])
    N, dims = K + TAIL, K * banks
    start = np.empty(9)
    expand(c, t, start)
    t[NORM] = np.sqrt(np.sum(command * command))
    reference = t[HEADER : HEADER + N * banks].reshape(-1, BLOCK)
    t[BEYOND] = _series(start, banks, t[NORM], reference)
    state = np.zeros(kernel.STREAM)
    state[1], state[2] = t[X0], t[V0]
    at = HEADER + N * banks
    column_sums, cross = t[at : at + dims], t[at + dims : at + 2 * dims]
    gram = t[at + 2 * dims : at + (2 + dims) * dims].reshape(dims, dims)
    x, e = np.zeros((dims, _SAMPLES)), np.empty(_SAMPLES)
    memory = np.zeros((dims, 2))
    first, n = 0, len(command)
    while first < n:
        last = min(first + _SAMPLES, n if first >= settle else settle)
        size = last - first
        x[0, :size] = command[first:last]
        if banks == 2:
            x[BLOCK, :size] = 0.0
            x[BLOCK, 0] = 1.0 if first == 0 else 0.0
        _filter_bank(x, size, banks, memory, t[POLE], t[DELTA])
        kernel.stream(c, state, command[first:last], e[:size])
        for i in range(size):
            e[i] = measured[first + i] - e[i]
        if first >= settle:
            for i in range(size):
                t[SUM] += e[i]
                t[SQUARES] += e[i] * e[i]
            _add_products(x, size, e, column_sums, cross, gram)
        first = last
    for i in range(dims):
        gram[i, i] *= 0.5
        gram[i, i + 1 :] = 0.0
    t[COUNT] = n - settle


@njit
def _half_form(gram: Array, z: Array, used: int) -> float:
    """Return half of z' A z over the first `used` terms, a multiple of four.

    Args:
        gram: lower triangle of A with the diagonal halved and zeros beside it, shape (dims, dims).
        z: shape (dims,) or longer.
        used: number of terms.
    """
    total = 0.0
    for i in range(0, used, 4):
        z0, z1, z2, z3 = z[i], z[i + 1], z[i + 2], z[i + 3]
        part = 0.0
        for k in range(i + 4):
            above = gram[i, k] * z0 + gram[i + 1, k] * z1
            part += z[k] * (above + (gram[i + 2, k] * z2 + gram[i + 3, k] * z3))
        total += part
    return total


@njit
def evaluate(t: Array, theta: Array, tolerance: float, out: Array, exact: Flags) -> None:
    """Write (sum e, sum e^2) of many thetas over one record, and which need the exact kernel.

    Each theta uses as many blocks of terms as its own truncation bound asks for.

    Args:
        t: the record's row.
        theta: shape (m, 4).
        tolerance: bound on the relative error of the sum of squares about the mean.
        out: shape (m, 2) [m, m^2].
        exact: shape (m,), True where the bound is not met (or the system does not exist).
    """
    banks, norm = 1 + int(t[FREE]), t[NORM]
    dims, N = int(t[TERMS]) * banks, (int(t[TERMS]) + TAIL) * banks
    reference = t[HEADER : HEADER + N].reshape(-1, BLOCK)
    sums = t[HEADER + N : HEADER + N + dims]
    cross = t[HEADER + N + dims : HEADER + N + 2 * dims]
    gram = t[HEADER + N + 2 * dims : HEADER + N + (2 + dims) * dims].reshape(dims, dims)
    enough = 0.4 * tolerance * np.sqrt(t[SQUARES] - t[SUM] * t[SUM] / t[COUNT])
    row, start, size = np.empty(kernel.COLUMNS), np.empty(9), np.empty(N // BLOCK)
    z = np.empty(N)
    blocks = z.reshape(-1, BLOCK)
    for m in range(len(theta)):
        n0, d2, d1, d0 = kernel.equation_2a(theta[m], t[STIFFNESS])
        kernel.discretise_one(d1 / d2, d0 / d2, n0 / d2, t[PERIOD], t[FOH] > 0.0, row)
        expand(row, t, start)
        tail = t[BEYOND] + _series(start, banks, norm, blocks)
        for block in range(len(size)):
            total = 0.0
            for i in range(BLOCK):
                blocks[block, i] -= reference[block, i]
                total += abs(blocks[block, i])
            size[block] = total * (norm if banks == 1 or block % 2 == 0 else 1.0)
        count = len(size)
        while count > 0 and (count * BLOCK > dims or tail + size[count - 1] <= enough):
            count -= 1
            tail += size[count]
        near = np.sqrt(t[SQUARES])
        for block in range(count):
            near += size[block]
        used = count * BLOCK
        s = q = 0.0
        for i in range(used):
            s += sums[i] * z[i]
            q += cross[i] * z[i]
        s, q = t[SUM] - s, t[SQUARES] + 2.0 * (_half_form(gram, z, used) - q)
        out[m, 0], out[m, 1] = s, q
        about_mean = q - s * s / t[COUNT]
        bound = (2.0 * np.sqrt(max(about_mean, 0.0)) + tail) * tail + _ROUNDING * near * near
        exact[m] = not bound <= tolerance * about_mean


@njit
def evaluate_all(rows: Array, theta: Array, tolerance: float, out: Array, exact: Flags) -> bool:
    """Do `evaluate` for every record; out (m, R, 2), exact (R, m). Return whether any is exact."""
    for r in range(len(rows)):
        evaluate(rows[r], theta, tolerance, out[:, r], exact[r])
    return bool(exact.any())
