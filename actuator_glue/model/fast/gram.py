"""What the fast likelihood computes once per window: filtered commands and their products.

Derivation: docs/fast_path.md, section 3.
"""

from __future__ import annotations

import numpy as np

from actuator_glue.jit import njit
from actuator_glue.model import kernel
from actuator_glue.model.fast.laguerre import (
    BEYOND,
    BLOCK,
    COUNT,
    DELTA,
    DELTA_2,
    FREE,
    HEADER,
    NORM,
    POLE,
    POLE_2,
    SHIFT,
    SQUARES,
    START,
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
_NOTHING = 1e-20  # of an impulse: a smaller remainder is not filtered on


@njit
def _filter_bank(x: Array, size: int, memory: Array, t: Array) -> None:
    """Fill the rows of x with its first one passed through ever more sections.

    A section is (1 - pole z)/(z - pole), its pole in turn that of the row's first and second kind.
    Written as delta (z + 1)/(z - pole) - 1, which loses nothing when the pole is near one.
    Four sections at once, for each waits for its own last result most of the time.

    Args:
        x: shape (K + 1, samples), K a multiple of four; x[0] is the input.
        size: samples to be filtered.
        memory: each section's last input and low-pass output across blocks, shape (K + 1, 2).
        t: the record's row.
    """
    pole, delta, pole_2, delta_2 = t[POLE], t[DELTA], t[POLE_2], t[DELTA_2]
    for k in range(1, len(x), 4):
        before0, low0 = memory[k, 0], memory[k, 1]
        before1, low1 = memory[k + 1, 0], memory[k + 1, 1]
        before2, low2 = memory[k + 2, 0], memory[k + 2, 1]
        before3, low3 = memory[k + 3, 0], memory[k + 3, 1]
        for n in range(size):
            new0 = x[k - 1, n]
            low0 = pole * low0 + delta * (new0 + before0)
            new1 = low0 - new0
            low1 = pole_2 * low1 + delta_2 * (new1 + before1)
            new2 = low1 - new1
            low2 = pole * low2 + delta * (new2 + before2)
            new3 = low2 - new2
            low3 = pole_2 * low3 + delta_2 * (new3 + before3)
            before0, before1, before2, before3 = new0, new1, new2, new3
            x[k, n], x[k + 1, n], x[k + 2, n], x[k + 3, n] = new1, new2, new3, low3 - new3
        memory[k, 0], memory[k, 1] = before0, low0
        memory[k + 1, 0], memory[k + 1, 1] = before1, low1
        memory[k + 2, 0], memory[k + 2, 1] = before2, low2
        memory[k + 3, 0], memory[k + 3, 1] = before3, low3


@njit
def _add_products(x: Array, size: int, impulse: bool, e: Array, products: Array) -> None:
    """Add each row's products: (banks, K, 6).

    With both banks' inputs, with e, with one, and those of even rows with both banks' first
    rows. The second bank's input is an impulse, at the first sample if `impulse`.
    """
    u, first, free = x[0, 0], x[0, 1], x[len(x) - 1, 1]
    for bank in range(len(x)):
        for k in range(0, products.shape[1], 2):
            row, next_row = x[bank, k], x[bank, k + 1]
            product = error = total = next_product = next_error = next_total = 0.0
            along = along_free = 0.0
            for n in range(size):
                product += row[n] * u[n]
                error += row[n] * e[n]
                total += row[n]
                along += row[n] * first[n]
                along_free += row[n] * free[n]
                next_product += next_row[n] * u[n]
                next_error += next_row[n] * e[n]
                next_total += next_row[n]
            products[bank, k, 0] += product
            products[bank, k, 2] += error
            products[bank, k, 3] += total
            products[bank, k, 4] += along
            products[bank, k + 1, 0] += next_product
            products[bank, k + 1, 2] += next_error
            products[bank, k + 1, 3] += next_total
            if len(x) == 2:  # else the second bank's rows have died away
                products[bank, k, 5] += along_free
            if impulse:
                products[bank, k, 1] += row[0]
                products[bank, k + 1, 1] += next_row[0]


@njit
def _fill_states(memory: Array, t: Array, states: Array) -> None:
    """Fill sections' states in coordinates in which they are lossless; memory is (..., 2).

    Number by number: numba takes seconds to compile the message of an assignment between arrays
    that do not fit.
    """
    for kind, pole, delta in ((1, t[POLE], t[DELTA]), (0, t[POLE_2], t[DELTA_2])):
        scale = np.sqrt(delta * (2.0 - delta))
        for bank in range(len(memory)):
            for k in range(kind, memory.shape[1], 2):
                some = memory[bank, k]
                states[bank, k] = (pole * some[1] + delta * some[0]) / scale


@njit
def _across(states: Array, a: int, k: int, b: int, m: int, cosine: float, sine: float) -> float:
    """Return the product of the states of two sections each behind columns k and m, k - m odd.

    The two sections follow one another in opposite order: their states are each other's but for a
    rotation, of those behind the odd column.
    """
    if k % 2:
        a, k, b, m = b, m, a, k
    first, second = states[b, m + 1], states[b, m + 2]
    product: float = states[a, k + 1] * (cosine * first - sine * second)
    product += states[a, k + 2] * (sine * first + cosine * second)
    return product


@njit
def _fill_gram(products: Array, start: Array, end: Array, t: Array, gram: Array) -> None:
    """Fill the lower triangle of A = [u_k' u_l], its diagonal halved.

    Sections are lossless: over the counted samples u_(k+1)' u_(l+1) exceeds u_k' u_l by the
    products of the two sections' states at the start less those at the end, where both have the
    same pole; else u_(k+2)' u_(l+2) does, by those of two sections each.

    Args:
        products: see `_add_products`.
        start: `_fill_states` at the first counted sample, shape (banks, K + 1).
        end: the same after the last.
        t: the record's row.
        gram: shape (dims, dims); the banks' blocks of terms take turns.
    """
    banks, K = products.shape[:2]
    cosine, sine = np.sqrt(1.0 - t[SHIFT] * t[SHIFT]), -t[SHIFT]
    for a in range(banks):
        for b in range(banks):
            for shift in range(0, K, 2):
                value = products[b, shift, a]
                for k in range(K - shift):
                    _put(gram, banks, a, k, b, k + shift, value)
                    if k + shift + 1 < K:
                        value += start[a, k + 1] * start[b, k + shift + 1]
                        value -= end[a, k + 1] * end[b, k + shift + 1]
            for shift in range(1, K, 2):
                for first in range(min(2, K - shift)):
                    value = products[b, shift + first, 4 * first + a]
                    for k in range(first, K - shift, 2):
                        m = k + shift
                        _put(gram, banks, a, k, b, m, value)
                        if m + 2 < K:
                            value += _across(start, a, k, b, m, cosine, sine)
                            value -= _across(end, a, k, b, m, cosine, sine)


@njit
def _put(gram: Array, banks: int, a: int, k: int, b: int, m: int, value: float) -> None:
    """Enter u_k' u_m of two banks, halved on the diagonal."""
    i = (k // BLOCK * banks + a) * BLOCK + k % BLOCK
    j = (m // BLOCK * banks + b) * BLOCK + m % BLOCK
    gram[max(i, j), min(i, j)] = value if i != j else 0.5 * value


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
    at = HEADER + N * banks
    expanded = np.empty(START)
    expand(c, t, expanded)
    t[NORM] = np.sqrt(np.sum(command * command))
    reference = t[HEADER:at].reshape(-1, BLOCK)
    t[BEYOND] = t[NORM] * series(expanded, 0, banks, reference)
    if banks == 2:
        t[BEYOND] += series(expanded, 1, banks, reference)
    state = np.zeros(kernel.STREAM)
    state[1], state[2] = t[X0], t[V0]
    x, e = np.zeros((banks, K + 1, _SAMPLES)), np.empty(_SAMPLES)
    memory, products = np.zeros((banks, K + 1, 2)), np.zeros((banks, K, 6))
    start = np.zeros((banks, K + 1))
    first, n, filtered = 0, len(command), banks
    while first < n:
        last = min(first + _SAMPLES, n if first >= settle else settle)
        size = last - first
        if first == settle:
            _fill_states(memory[:filtered], t, start)
        for i in range(size):
            x[0, 0, i] = command[first + i]
        if banks == 2:
            x[1, 0, 0] = 1.0 if first == 0 else 0.0
        for bank in range(filtered):
            _filter_bank(x[bank], size, memory[bank], t)
        kernel.stream(c, state, command[first:last], e[:size])
        for i in range(size):
            e[i] = measured[first + i] - e[i]
        if first >= settle:
            for i in range(size):
                t[SUM] += e[i]
                t[SQUARES] += e[i] * e[i]
            _add_products(x[:filtered], size, banks == 2 and first == 0, e, products)
        if filtered == 2 and np.abs(memory[1]).max() < _NOTHING:
            filtered, memory[1] = 1, 0.0
        first = last
    t[COUNT] = n - settle
    for bank in range(banks):
        for k in range(K):
            i = at + (k // BLOCK * banks + bank) * BLOCK + k % BLOCK
            t[i], t[i + dims] = products[bank, k, 3], products[bank, k, 2]
    gram = t[at + 2 * dims : at + (2 + dims) * dims].reshape(dims, dims)
    end = np.empty((banks, K + 1))
    _fill_states(memory, t, end)
    _fill_gram(products, start, end, t, gram)
