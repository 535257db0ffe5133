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

TAIL = 16  # terms beyond the basis that are summed one by one for the truncation bound
_BLOCK = 256  # samples per pass of the filter bank: the bank's outputs stay in the cache
_WIDTH = 8  # thetas expanded together
_FAR = 1e4  # misfit, relative to the reference's, up to which the tolerance grows with it

# One row per record: numbers, then reference coefficients, column sums, cross products, Gram.
(TERMS, FREE, STIFFNESS, PERIOD, FOH, POLE, DELTA, X0, V0, U0, NORM, COUNT, SUM, SQUARES) = range(
    14
)
HEADER = 14


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
def _filter_bank(
    x: Array, size: int, banks: int, memory: Array, pole: float, delta: float
) -> None:
    """Fill rows banks.. of x with the row `banks` before passed through (1 - pole z)/(z - pole).

    Written as zeta = delta (z + 1)/(z - pole) - 1, which loses nothing when the pole is near one.
    `memory` (rows, 2) holds each section's last input and low-pass output across blocks.
    """
    for row in range(banks, len(x)):
        before, low = memory[row, 0], memory[row, 1]
        for n in range(size):
            new = x[row - banks, n]
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
    reference = t[HEADER : HEADER + N * banks]
    for i in range(len(reference)):
        k, bank = i // banks, i % banks
        if k < 3:
            reference[i] = start[2 + 3 * bank + k]
        else:
            reference[i] = -start[0] * reference[i - banks] - start[1] * reference[i - 2 * banks]
    state = np.zeros(kernel.STREAM)
    state[1], state[2] = t[X0], t[V0]
    at = HEADER + N * banks
    column_sums, cross = t[at : at + dims], t[at + dims : at + 2 * dims]
    gram = t[at + 2 * dims : at + (2 + dims) * dims].reshape(dims, dims)
    x, e = np.zeros((dims, _BLOCK)), np.empty(_BLOCK)  # both banks take turns
    memory = np.zeros((dims, 2))
    first, n = 0, len(command)
    while first < n:
        last = min(first + _BLOCK, n if first >= settle else settle)
        size = last - first
        x[0, :size] = command[first:last]
        if banks == 2:
            x[1, :size] = 0.0
            x[1, 0] = 1.0 if first == 0 else 0.0
        _filter_bank(x, size, banks, memory, t[POLE], t[DELTA])
        kernel.stream(c, state, command[first:last], e[:size])
        for i in range(size):
            e[i] = measured[first + i] - e[i]
            t[NORM] += command[first + i] ** 2
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
    t[NORM] = np.sqrt(t[NORM])


@njit
def _differences(t: Array, theta: Array, first: int, z: Array, beyond: Array) -> None:
    """Fill z with all terms less the reference's, and bound what follows them, for one block.

    Args:
        t: the record's row.
        theta: shape (m, 4); beyond its end the last one is repeated.
        first: the block's first theta.
        z: shape (terms, _WIDTH), both banks taking turns.
        beyond: shape (_WIDTH,) [m].
    """
    W, banks, norm = _WIDTH, 1 + int(t[FREE]), t[NORM]
    starts = np.empty((9, W))
    row, start = np.empty(kernel.COLUMNS), np.empty(9)
    for j in range(W):
        one = theta[min(first + j, len(theta) - 1)]
        n0, d2, d1, d0 = kernel.equation_2a(one, t[STIFFNESS])
        kernel.discretise_one(d1 / d2, d0 / d2, n0 / d2, t[PERIOD], t[FOH] > 0.0, row)
        expand(row, t, start)
        starts[:, j] = start
    N = len(z)
    for i in range(3):
        for bank in range(banks):
            z[i * banks + bank] = starts[2 + 3 * bank + i]
    for i in range(3 * banks, N):
        for j in range(W):
            z[i, j] = -starts[0, j] * z[i - banks, j] - starts[1, j] * z[i - 2 * banks, j]
    beyond[:] = 0.0
    for bank in range(banks):
        i = N - banks + bank
        for j in range(W):
            weight = 1.0 if bank else norm
            beyond[j] += weight * _beyond(starts[8, j], z[i, j], z[i - banks, j])
    for i in range(N):
        reference = t[HEADER + i]
        for j in range(W):
            z[i, j] -= reference


@njit
def _two_rows(gram: Array, dims: int, i: int, z: Array, term: Array) -> None:
    """Write rows i and i + 1 of (lower triangle, diagonal halved) times z into `term`.

    Four columns at a time; the triangle is stored with zeros up to the next multiple of four.
    """
    term[:] = 0.0
    a, b = gram[i * dims : (i + 1) * dims], gram[(i + 1) * dims : (i + 2) * dims]
    for k in range(0, i + 2, 4):
        a0, a1, a2, a3 = a[k], a[k + 1], a[k + 2], a[k + 3]
        b0, b1, b2, b3 = b[k], b[k + 1], b[k + 2], b[k + 3]
        for j in range(_WIDTH):
            z0, z1, z2, z3 = z[k, j], z[k + 1, j], z[k + 2, j], z[k + 3, j]
            term[0, j] += (a0 * z0 + a1 * z1) + (a2 * z2 + a3 * z3)
            term[1, j] += (b0 * z0 + b1 * z1) + (b2 * z2 + b3 * z3)


@njit
def evaluate(t: Array, theta: Array, tolerance: float, out: Array, exact: Flags) -> None:
    """Write (sum e, sum e^2) of many thetas over one record, and which need the exact kernel.

    A block of thetas uses as many terms as its own truncation bound asks for.

    Args:
        t: the record's row.
        theta: shape (m, 4).
        tolerance: bound on the relative error of the sum of squares about the mean, times the
            ratio of that sum to the reference's where it is larger than one.
        out: shape (m, 2) [m, m^2].
        exact: shape (m,), True where the bound is not met (or the system does not exist).
    """
    W = _WIDTH
    banks, norm = 1 + int(t[FREE]), t[NORM]
    dims, N = int(t[TERMS]) * banks, (int(t[TERMS]) + TAIL) * banks
    sums, cross, gram = HEADER + N, HEADER + N + dims, HEADER + N + 2 * dims
    least = t[SQUARES] - t[SUM] * t[SUM] / t[COUNT]
    enough = 0.1 * tolerance * np.sqrt(least)
    z = np.empty((N, W))
    tail, near, s, q = np.empty(W), np.empty(W), np.empty(W), np.empty(W)
    term = np.empty((2, W))
    for first in range(0, len(theta), W):
        _differences(t, theta, first, z, tail)
        used = N
        while used > 0:
            weight = norm if banks == 1 or used % 2 == 1 else 1.0
            more = 0.0
            for j in range(W):
                near[j] = tail[j] + weight * abs(z[used - 1, j])
                more = max(more, near[j])
            if used <= dims and not more <= enough:
                break
            used -= 1
            tail[:] = near
        used += used % 2
        near[:] = 0.0
        s[:] = t[SUM]
        q[:] = t[SQUARES]
        for i in range(0, used, 2):
            _two_rows(t[gram:], dims, i, z, term)
            for half in range(2):
                n = i + half
                weight = norm if banks == 1 or n % 2 == 0 else 1.0
                for j in range(W):
                    s[j] -= t[sums + n] * z[n, j]
                    q[j] += 2.0 * z[n, j] * (term[half, j] - t[cross + n])
                    near[j] += weight * abs(z[n, j])
        for j in range(min(W, len(theta) - first)):
            out[first + j, 0], out[first + j, 1] = s[j], q[j]
            about_mean = q[j] - s[j] * s[j] / t[COUNT]
            rounding = 1e-15 * (np.sqrt(t[SQUARES]) + near[j]) ** 2
            bound = (2.0 * np.sqrt(max(about_mean, 0.0)) + tail[j]) * tail[j] + rounding
            # Far from the best fit less accuracy does: L itself is lower by G ln(misfit).
            misfit = min(max(about_mean / least, 1.0), _FAR)
            exact[first + j] = not bound <= tolerance * misfit * about_mean


@njit
def evaluate_all(rows: Array, theta: Array, tolerance: float, out: Array, exact: Flags) -> bool:
    """Do `evaluate` for every record; out (m, R, 2), exact (R, m). Return whether any is exact."""
    for r in range(len(rows)):
        evaluate(rows[r], theta, tolerance, out[:, r], exact[r])
    return bool(exact.any())
