"""Compiled quadratic form of the fast likelihood: its preparation and its evaluation.

Derivation and error bound: docs/fast_path.md, sections 3 to 5.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model import kernel
from actuator_glue.model.laguerre import (
    BEYOND,
    BLOCK,
    COUNT,
    DELTA,
    FOH,
    FREE,
    HEADER,
    NORM,
    PERIOD,
    POLE,
    SQUARES,
    STIFFNESS,
    SUM,
    TAIL,
    TERMS,
    V0,
    X0,
    expand,
    series,
)
from actuator_glue.records import Array

Flags: TypeAlias = NDArray[np.bool_]

_SAMPLES = 256  # samples per pass of the filter bank: the bank's outputs stay in the cache
_ROUNDING = 1e-15  # of the quadratic form, relative to the largest of what it adds up


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


@njit(nogil=True)
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
    t[BEYOND] = series(start, banks, t[NORM], reference)
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
def _sums(
    t: Array, sums: Array, cross: Array, gram: Array, z: Array, used: int, out: Array
) -> float:
    """Write (sum e, sum e^2) from the first `used` terms; return the sum about the mean.

    Args:
        t: the record's row; `sums`, `cross`, `gram` are parts of it.
        sums: column sums, shape (dims,).
        cross: products of the columns with the reference's errors, shape (dims,).
        gram: as `_half_form` takes it.
        z: terms less the reference's.
        used: number of terms, a multiple of four.
        out: shape (2,) [m, m^2].
    """
    s = q = 0.0
    for i in range(used):
        s += sums[i] * z[i]
        q += cross[i] * z[i]
    s, q = t[SUM] - s, t[SQUARES] + 2.0 * (_half_form(gram, z, used) - q)
    out[0], out[1] = s, q
    about_mean: float = q - s * s / t[COUNT]
    return about_mean


@njit
def _trusted(about_mean: float, tail: float, near: float, tolerance: float) -> bool:
    """Return whether truncation and rounding stay within the tolerance.

    Args:
        about_mean: sum of squares about the mean [m^2].
        tail: bound of the norm of what the terms left out contribute [m].
        near: bound of the norms of what is added up [m].
        tolerance: relative.
    """
    bound = (2.0 * np.sqrt(max(about_mean, 0.0)) + tail) * tail + _ROUNDING * near * near
    return bool(bound <= tolerance * about_mean)


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
    N = (int(t[TERMS]) + TAIL) * banks
    dims = int(t[TERMS]) * banks
    full = dims // BLOCK
    reference = t[HEADER : HEADER + N].reshape(-1, BLOCK)
    sums, cross = t[HEADER + N : HEADER + N + dims], t[HEADER + N + dims : HEADER + N + 2 * dims]
    gram = t[HEADER + N + 2 * dims : HEADER + N + (2 + dims) * dims].reshape(dims, dims)
    enough = 0.4 * tolerance * np.sqrt(t[SQUARES] - t[SUM] * t[SUM] / t[COUNT])
    row, start, size = np.empty(kernel.COLUMNS), np.empty(9), np.empty(N // BLOCK)
    z = np.empty(N)
    blocks = z.reshape(-1, BLOCK)
    for m in range(len(theta)):
        n0, d2, d1, d0 = kernel.equation_2a(theta[m], t[STIFFNESS])
        kernel.discretise_one(d1 / d2, d0 / d2, n0 / d2, t[PERIOD], t[FOH] > 0.0, row)
        expand(row, t, start)
        tail = t[BEYOND] + series(start, banks, norm, blocks)
        for block in range(len(size)):
            total = 0.0
            for i in range(BLOCK):
                blocks[block, i] -= reference[block, i]
                total += abs(blocks[block, i])
            size[block] = total * (norm if banks == 1 or block % 2 == 0 else 1.0)
        for block in range(full, len(size)):
            tail += size[block]
        count, left = full, tail
        while count > 0 and left + size[count - 1] <= enough:
            count -= 1
            left += size[count]
        near = np.sqrt(t[SQUARES]) + np.sum(size[:full])
        square = _sums(t, sums, cross, gram, z, count * BLOCK, out[m])
        exact[m] = not _trusted(square, left, near, tolerance)
        if exact[m] and count < full:  # it fits much better than the reference
            square = _sums(t, sums, cross, gram, z, full * BLOCK, out[m])
            exact[m] = not _trusted(square, tail, near, tolerance)


@njit(nogil=True)
def evaluate_all(rows: Array, theta: Array, tolerance: float, out: Array, exact: Flags) -> bool:
    """Do `evaluate` for every record; out (m, R, 2), exact (R, m). Return whether any is exact."""
    for r in range(len(rows)):
        evaluate(rows[r], theta, tolerance, out[:, r], exact[r])
    return bool(exact.any())
