"""Compiled quadratic form of the fast likelihood, evaluated per theta.

Derivation and error bound: docs/fast_path.md, sections 4 and 5. `gram` computes once per window
what it is made of.
"""

from __future__ import annotations

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model import kernel
from actuator_glue.model.fast.laguerre import (
    BEYOND,
    BLOCK,
    COUNT,
    FOH,
    FREE,
    HEADER,
    NORM,
    PERIOD,
    SQUARES,
    START,
    STIFFNESS,
    SUM,
    TAIL,
    TERMS,
    expand,
    series,
)
from actuator_glue.records import Array

_ROUNDING = 1e-15  # of the quadratic form, relative to the largest of what it adds up


@njit
def _half_form(gram: Array, z: Array, used: int) -> float:
    """Return half of z' A z over the first `used` terms, a multiple of eight.

    Args:
        gram: lower triangle of A with the diagonal halved and zeros beside it, shape (dims, dims).
        z: shape (dims,) or longer.
        used: number of terms.
    """
    total = 0.0
    for i in range(0, used, BLOCK):
        z0, z1, z2, z3 = z[i], z[i + 1], z[i + 2], z[i + 3]
        z4, z5, z6, z7 = z[i + 4], z[i + 5], z[i + 6], z[i + 7]
        part = 0.0
        # Whole vectors, even where they are half zeros: what is left over goes one by one.
        for k in range(min((i // BLOCK + 2) // 2 * (2 * BLOCK), len(gram))):
            a = gram[i, k] * z0 + gram[i + 1, k] * z1
            b = gram[i + 2, k] * z2 + gram[i + 3, k] * z3
            c = gram[i + 4, k] * z4 + gram[i + 5, k] * z5
            d = gram[i + 6, k] * z6 + gram[i + 7, k] * z7
            part += z[k] * ((a + b) + (c + d))
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
        used: number of terms, a multiple of eight.
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
def _slack(about_mean: float, tail: float, near: float, tolerance: float) -> float:
    """Bound the error of the sum about the mean; 0 where it stays within the tolerance [m^2].

    Args:
        about_mean: sum of squares about the mean [m^2].
        tail: bound of the norm of what the terms left out contribute [m].
        near: bound of the norms of what is added up [m].
        tolerance: relative.
    """
    bound: float = (2.0 * np.sqrt(max(about_mean, 0.0)) + tail) * tail + _ROUNDING * near * near
    return 0.0 if bound <= tolerance * about_mean else bound


@njit
def evaluate(t: Array, theta: Array, tolerance: float, out: Array, slack: Array) -> None:
    """Write (sum e, sum e^2) of many thetas over one record, and how far they may be wrong.

    Each theta uses as many blocks of terms as its own truncation bound asks for.

    Args:
        t: the record's row.
        theta: shape (m, 4).
        tolerance: bound on the relative error of the sum of squares about the mean.
        out: shape (m, 2) [m, m^2].
        slack: shape (m,), 0 where the tolerance is met and the exact kernel is not needed, else
            the bound of the error of the sum about the mean [m^2]; NaN for no such system.
    """
    banks, norm = 1 + int(t[FREE]), t[NORM]
    N, dims = (int(t[TERMS]) + TAIL) * banks, int(t[TERMS]) * banks
    full, at = dims // BLOCK, HEADER + N
    reference = t[HEADER:at].reshape(-1, BLOCK)
    sums, cross = t[at : at + dims], t[at + dims : at + 2 * dims]
    gram = t[at + 2 * dims : at + (2 + dims) * dims].reshape(dims, dims)
    enough = 0.4 * tolerance * np.sqrt(t[SQUARES] - t[SUM] * t[SUM] / t[COUNT])
    row, start, size = np.empty(kernel.COLUMNS), np.empty(START), np.empty(N // BLOCK)
    z = np.empty(N)
    blocks = z.reshape(-1, BLOCK)
    for m in range(len(theta)):
        n0, d2, d1, d0 = kernel.equation_2a(theta[m], t[STIFFNESS])
        kernel.discretise_one(d1 / d2, d0 / d2, n0 / d2, t[PERIOD], t[FOH] > 0.0, row)
        expand(row, t, start)
        tail = t[BEYOND] + norm * series(start, 0, banks, blocks)
        if banks == 2:
            tail += series(start, 1, banks, blocks)
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
        slack[m] = _slack(square, left, near, tolerance)
        if slack[m] != 0.0 and count < full:  # it fits much better than the reference
            square = _sums(t, sums, cross, gram, z, full * BLOCK, out[m])
            slack[m] = _slack(square, tail, near, tolerance)


@njit(nogil=True)
def evaluate_all(rows: Array, theta: Array, tolerance: float, out: Array, slack: Array) -> bool:
    """Do `evaluate` for every record: out (m, R, 2), slack (R, m); return whether any is not 0."""
    for r in range(len(rows)):
        evaluate(rows[r], theta, tolerance, out[:, r], slack[r])
    return bool((slack != 0.0).any())
