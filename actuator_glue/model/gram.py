"""What the fast likelihood computes once per window: filtered commands and their products.

Derivation: docs/fast_path.md, section 3.
"""

from __future__ import annotations

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model import kernel
from actuator_glue.model.laguerre import (
    BEYOND,
    BLOCK,
    COUNT,
    DELTA,
    FREE,
    HEADER,
    NORM,
    POLE,
    SQUARES,
    SUM,
    TAIL,
    TERMS,
    V0,
    X0,
    expand,
    series,
)
from actuator_glue.records import Array

_SAMPLES = 256  # samples per pass of the filter banks: their outputs stay in the cache


@njit
def _filter_banks(x: Array, size: int, memory: Array, pole: float, delta: float) -> None:
    """Fill each bank's rows of x with its first one passed through (1 - pole z)/(z - pole).

    Written as zeta = delta (z + 1)/(z - pole) - 1, which loses nothing when the pole is near one.
    Both banks and two sections at once, for each waits for its own last result most of the time;
    so there is a section more than there are terms.

    Args:
        x: shape (2, K + 1, samples); x[:, 0] are the inputs.
        size: samples to be filtered.
        memory: each section's last input and low-pass output across blocks, shape (2, K + 1, 2).
        pole: a.
        delta: 1 - a.
    """
    for k in range(1, x.shape[1] - 1, 2):
        before0, low0 = memory[0, k, 0], memory[0, k, 1]
        before1, low1 = memory[1, k, 0], memory[1, k, 1]
        before2, low2 = memory[0, k + 1, 0], memory[0, k + 1, 1]
        before3, low3 = memory[1, k + 1, 0], memory[1, k + 1, 1]
        for n in range(size):
            new0, new1 = x[0, k - 1, n], x[1, k - 1, n]
            low0 = pole * low0 + delta * (new0 + before0)
            low1 = pole * low1 + delta * (new1 + before1)
            before0, before1 = new0, new1
            new2, new3 = low0 - new0, low1 - new1
            low2 = pole * low2 + delta * (new2 + before2)
            low3 = pole * low3 + delta * (new3 + before3)
            before2, before3 = new2, new3
            x[0, k, n], x[1, k, n] = new2, new3
            x[0, k + 1, n], x[1, k + 1, n] = low2 - new2, low3 - new3
        memory[0, k, 0], memory[0, k, 1] = before0, low0
        memory[1, k, 0], memory[1, k, 1] = before1, low1
        memory[0, k + 1, 0], memory[0, k + 1, 1] = before2, low2
        memory[1, k + 1, 0], memory[1, k + 1, 1] = before3, low3


@njit
def _add_products(x: Array, size: int, e: Array, products: Array) -> None:
    """Add each row's products with both banks' inputs, with e, and its sum: (2, K, 4)."""
    u, v = x[0, 0], x[1, 0]
    for bank in range(2):
        for k in range(products.shape[1]):
            row = x[bank, k]
            total = errors = first = second = 0.0
            for n in range(size):
                total += row[n]
                errors += row[n] * e[n]
                first += row[n] * u[n]
                second += row[n] * v[n]
            products[bank, k, 0] += first
            products[bank, k, 1] += second
            products[bank, k, 2] += errors
            products[bank, k, 3] += total


@njit
def _states(memory: Array, pole: float, delta: float) -> Array:
    """Return each section's state in coordinates in which it is lossless, (2, sections)."""
    scale = np.sqrt(delta * (2.0 - delta))
    states: Array = (pole * memory[:, :, 1] + delta * memory[:, :, 0]) / scale
    return states


@njit
def _fill_gram(products: Array, start: Array, end: Array, banks: int, gram: Array) -> None:
    """Fill the lower triangle of A = [u_k' u_l], its diagonal halved.

    Sections are lossless: over the counted samples u_(k+1)' u_(l+1) exceeds u_k' u_l by the
    products of the two sections' states at the start less those at the end.

    Args:
        products: products with the two inputs, shape (2, K, 2 or more).
        start: `_states` at the first counted sample, shape (2, K or more).
        end: `_states` after the last.
        banks: how many are in use; their blocks of terms take turns.
        gram: shape (dims, dims).
    """
    K = products.shape[1]
    for a in range(banks):
        for b in range(banks):
            for shift in range(K):
                value = products[b, shift, a]
                for k in range(K - shift):
                    i = (k // BLOCK * banks + a) * BLOCK + k % BLOCK
                    j = ((k + shift) // BLOCK * banks + b) * BLOCK + (k + shift) % BLOCK
                    gram[max(i, j), min(i, j)] = value if i != j else 0.5 * value
                    if k + shift + 1 < K:
                        value += start[a, k + 1] * start[b, k + shift + 1]
                        value -= end[a, k + 1] * end[b, k + shift + 1]


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
    first_terms = np.empty(9)
    expand(c, t, first_terms)
    t[NORM] = np.sqrt(np.sum(command * command))
    reference = t[HEADER : HEADER + N * banks].reshape(-1, BLOCK)
    t[BEYOND] = series(first_terms, banks, t[NORM], reference)
    state = np.zeros(kernel.STREAM)
    state[1], state[2] = t[X0], t[V0]
    x, e = np.zeros((2, K + 1, _SAMPLES)), np.empty(_SAMPLES)
    memory, products = np.zeros((2, K + 1, 2)), np.zeros((2, K, 4))
    start = np.zeros((2, K + 1))
    first, n = 0, len(command)
    while first < n:
        last = min(first + _SAMPLES, n if first >= settle else settle)
        size = last - first
        if first == settle:
            start = _states(memory, t[POLE], t[DELTA])
        x[0, 0, :size] = command[first:last]
        x[1, 0, :size] = 0.0
        x[1, 0, 0] = 1.0 if first == 0 else 0.0
        _filter_banks(x, size, memory, t[POLE], t[DELTA])
        kernel.stream(c, state, command[first:last], e[:size])
        for i in range(size):
            e[i] = measured[first + i] - e[i]
        if first >= settle:
            for i in range(size):
                t[SUM] += e[i]
                t[SQUARES] += e[i] * e[i]
            _add_products(x, size, e, products)
        first = last
    t[COUNT] = n - settle
    at = HEADER + N * banks
    for bank in range(banks):
        for k in range(K):
            i = at + (k // BLOCK * banks + bank) * BLOCK + k % BLOCK
            t[i], t[i + dims] = products[bank, k, 3], products[bank, k, 2]
    gram = t[at + 2 * dims : at + (2 + dims) * dims].reshape(dims, dims)
    _fill_gram(products, start, _states(memory, t[POLE], t[DELTA]), banks, gram)
