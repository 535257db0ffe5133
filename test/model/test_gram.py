"""The expansion and the products behind the fast likelihood, against what they stand for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from actuator_glue.model import kernel
from actuator_glue.model.fast import gram, laguerre
from actuator_glue.model.fast.laguerre import BLOCK

K = 32


def row_of(poles, period=1e-3, foh=False, moving=False, start=(0.0, 0.0, 0.0)):
    """An empty row with its header, for sections at s = -sigma of the two poles [1/s]."""
    width = laguerre.HEADER + (K + laguerre.TAIL) * (1 + moving) + K * (1 + moving) * (2 + K * 2)
    row = np.zeros(width)
    a = 1.0 + np.expm1(-np.array(poles) * period)
    d = 1.0 - a
    names = (laguerre.TERMS, laguerre.FREE, laguerre.PERIOD, laguerre.FOH)
    row[list(names)] = K, moving, period, foh
    row[[laguerre.POLE, laguerre.POLE_2]], row[[laguerre.DELTA, laguerre.DELTA_2]] = a, d
    row[laguerre.SHIFT] = (d[1] - d[0]) / (d[0] + d[1] - d[0] * d[1])
    row[[laguerre.X0, laguerre.V0, laguerre.U0]] = start
    return row


def sections(row, z):
    """The all-passes' values at points z, shape (2, len(z))."""
    poles = row[[laguerre.POLE, laguerre.POLE_2], np.newaxis]
    return (1.0 - poles * z) / (z - poles)


@settings(max_examples=100, deadline=None)
@given(
    frequency=st.floats(5.0, 300.0),
    damping=st.floats(0.3, 3.0),
    off=st.tuples(st.floats(0.8, 1.25), st.floats(0.8, 1.25)),
    apart=st.floats(1.0, 5.0),
    period=st.sampled_from([1e-4, 1e-3, 4e-3]),
    foh=st.booleans(),
)
def test_terms_add_up_to_the_transfer_function(frequency, damping, off, apart, period, foh):
    """Within the bound of the terms left out and rounding, real and complex poles alike."""
    a1, a0 = 2.0 * damping * frequency * off[0], frequency * frequency * off[1]
    row = row_of((frequency / apart, frequency * apart), period, foh)
    c = kernel.discretise(np.array([[a1, a0, 0.97 * a0]]), period, foh)[0]
    start, terms = np.empty(laguerre.START), np.empty((20, BLOCK))
    laguerre.expand(c, row, start)
    beyond = laguerre.series(start, 0, 1, terms)
    z = np.exp(1j * np.geomspace(1e-3, 3.0, 40))
    zeta = sections(row, z)
    passed = np.cumprod(np.tile(zeta, (terms.size // 2, 1)), axis=0)
    columns = np.concatenate([np.ones((1, len(z))), passed[: terms.size - 1]])
    w = z - 1.0
    q0 = c[kernel.PULL]
    g = c[[kernel.G0, kernel.G1, kernel.G2]]
    numerator = g.sum() + (2.0 * g[0] + g[1]) * w + g[0] * w * w
    right = numerator / (w * w + (1.0 - c[kernel.DECAY] + q0) * w + q0)
    assert np.abs(terms.ravel() @ columns - right).max() <= beyond + 1e-11 * np.abs(right).max()


@pytest.mark.parametrize('poles', [(19.5, 114.8), (114.8, 19.5), (47.0, 47.0), (2.0, 900.0)])
@pytest.mark.parametrize('settle', [0, 130])
def test_products_follow_from_the_states(poles, settle):
    """A of both banks, sums and cross products against columns filtered one by one."""
    row = row_of(poles, moving=True, start=(1e-3, 0.02, 0.0))
    rng = np.random.default_rng(1)
    command = np.cumsum(rng.standard_normal(3000)) * 1e-5
    measured = command + 1e-5 * rng.standard_normal(3000)
    c = kernel.discretise(np.array([[134.0, 2233.0, 2233.0]]), 1e-3, False)[0]
    gram.prepare(row, c, measured, command, settle)
    columns = []
    for values in (command, np.eye(1, 3000)[0]):
        bank = [values]
        for k in range(1, K):
            a = row[laguerre.POLE if k % 2 else laguerre.POLE_2]
            bank.append(signal.lfilter([-a, 1.0], [1.0, -a], bank[-1]))
        columns.append(bank)
    # The banks' blocks of terms take turns.
    order = [columns[b][k + i] for k in range(0, K, BLOCK) for b in (0, 1) for i in range(BLOCK)]
    u = np.array(order)[:, settle:]
    dims = 2 * K
    at = laguerre.HEADER + (K + laguerre.TAIL) * 2
    error = np.empty(3000)
    state = np.zeros(kernel.STREAM)
    state[1:3] = 1e-3, 0.02
    kernel.stream(c, state, command, error)
    error = (measured - error)[settle:]
    size = np.sqrt((u * u).sum(axis=1))
    np.testing.assert_allclose(row[at : at + dims], u.sum(axis=1), rtol=0, atol=1e-11 * size.max())
    crossed = row[at + dims : at + 2 * dims]
    np.testing.assert_allclose(crossed, u @ error, rtol=0, atol=1e-13 * size.max())
    found = row[at + 2 * dims : at + (2 + dims) * dims].reshape(dims, dims)
    wanted = np.tril(u @ u.T) - 0.5 * np.diag(size * size)
    scale = np.linalg.norm([bank[0] for bank in columns], axis=1)
    whole = np.tile(np.repeat(scale, BLOCK), K // BLOCK)
    assert np.abs((found - wanted) / np.outer(whole, whole)).max() < 1e-12


def test_few_terms_are_left_where_poles_are_real():
    """Two poles in turn: what a system 3 % away leaves after 16 terms is below 1e-9."""
    row = row_of((19.45, 114.8))
    near = np.array([134.25, 2233.0, 2233.0]) * [1.03, 0.97, 0.97]
    c = kernel.discretise(near[np.newaxis], 1e-3, False)[0]
    start, terms = np.empty(laguerre.START), np.empty((3, BLOCK))
    laguerre.expand(c, row, start)
    laguerre.series(start, 0, 1, terms)
    assert np.abs(terms[2]).max() < 1e-9 * np.abs(terms[0]).max()
