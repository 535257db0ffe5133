"""Eq. (2) against scipy.signal and python-control, over the whole prior box."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal
from scipy.linalg import expm

from actuator_glue.errors import InputError
from actuator_glue.model import linear
from actuator_glue.model.parameters import TABLE_2, bounds
from actuator_glue.records import Record

LOWER, UPPER = bounds()
HOLDS = ('zoh', 'linear')
SCIPY_METHOD = {'zoh': 'zoh', 'linear': 'foh'}
CONTROL_METHOD = {'zoh': 'zoh', 'linear': 'foh'}
inside = st.tuples(*[st.floats(0.001, 1.0) for _ in LOWER]).map(
    lambda q: LOWER + np.array(q) * (UPPER - LOWER)
)


def transfer(theta, stiffness):
    n0, d2, d1, d0 = (float(part) for part in linear.coefficients(theta, stiffness))
    return [n0], [d2, d1, d0]


def command(n, seed=0):
    return 1e-3 * np.cumsum(np.random.default_rng(seed).standard_normal(n)) / np.sqrt(n)


def relative(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


@pytest.mark.parametrize('hold', HOLDS)
@pytest.mark.parametrize('stiffness', [0.0, 250e3])
@pytest.mark.parametrize('rate', [200.0, 1000.0, 10_000.0])
def test_response_agrees_with_scipy(hold, stiffness, rate):
    u = command(6000)
    u[0] = 0.0  # scipy's first-order hold takes a first sample other than zero as a ramp before it
    num, den = transfer(TABLE_2, stiffness)
    a, b, c, d, _ = signal.cont2discrete(
        signal.tf2ss(num, den), 1.0 / rate, method=SCIPY_METHOD[hold]
    )
    _, expected, _ = signal.dlsim((a, b, c, d, 1.0 / rate), u)
    ours = linear.simulate(TABLE_2, u, stiffness=stiffness, period=1.0 / rate, hold=hold)
    assert relative(ours, expected[:, 0]) < 1e-9


@pytest.mark.parametrize('hold', HOLDS)
@pytest.mark.parametrize('stiffness', [0.0, 250e3])
def test_difference_equation_agrees_with_control(hold, stiffness):
    period = 1.0 / 200.0
    sampled = control.sample_system(
        control.tf(*transfer(TABLE_2, stiffness)), period, method=CONTROL_METHOD[hold]
    )
    ours = linear.discretise(TABLE_2, stiffness, period, hold)
    num = np.asarray(sampled.num[0][0])
    expected = np.concatenate([np.zeros(3 - len(num)), num])
    np.testing.assert_allclose(ours.denominator, np.asarray(sampled.den[0][0]), rtol=1e-9)
    np.testing.assert_allclose(ours.numerator, expected, rtol=1e-9, atol=1e-14)


def test_lsim_of_the_continuous_system_agrees():
    u = command(3000)
    t = np.arange(3000) / 500.0
    _, expected, _ = signal.lsim(signal.TransferFunction(*transfer(TABLE_2, 250e3)), u, t)
    ours = linear.simulate(TABLE_2, u, stiffness=250e3, period=1 / 500.0, hold='linear')
    # lsim starts from rest and interpolates the command linearly, as 'linear' does.
    assert relative(ours, expected) < 1e-9


def reference(a1, a0, b0, period, u, hold, initial):
    """State-space response by the matrix exponential of the held input, one sample at a time."""
    big = np.zeros((4, 4))
    big[:2, :2] = [[0.0, 1.0], [-a0, -a1]]
    big[1, 2] = b0
    big[2, 3] = 1.0
    scale = np.diag([1.0, 1.0 / max(a1, np.sqrt(a0), 1.0), 1.0, 1.0])  # balance for expm
    phi = np.linalg.inv(scale) @ expm(scale @ big @ np.linalg.inv(scale) * period) @ scale
    x = np.array(initial, dtype=float)
    out = [x[0]]
    for n in range(len(u) - 1):
        slope = (u[n + 1] - u[n]) / period if hold == 'linear' else 0.0
        x = (phi @ np.array([x[0], x[1], u[n], slope]))[:2]
        out.append(x[0])
    return np.array(out)


@settings(max_examples=60, deadline=None)
@given(
    theta=inside,
    stiffness=st.sampled_from([0.0, 1e3, 250e3, 1e7]),
    rate=st.sampled_from([50.0, 200.0, 1000.0, 4096.0]),
    hold=st.sampled_from(HOLDS),
    initial=st.tuples(st.floats(-1e-2, 1e-2), st.floats(-0.3, 0.3)),
    seed=st.integers(0, 2**16),
)
def test_prior_box_agrees_with_matrix_exponential(theta, stiffness, rate, hold, initial, seed):
    u = command(200, seed)
    a1, a0, b0 = linear.systems(theta, stiffness)[0]
    expected = reference(a1, a0, b0, 1.0 / rate, u, hold, initial)
    ours = linear.simulate(
        theta, u, stiffness=stiffness, period=1.0 / rate, hold=hold, initial=initial
    )
    scale = np.abs(expected).max() + 1e-12
    assert np.abs(ours - expected).max() / scale < 1e-9


@pytest.mark.parametrize('hold', HOLDS)
@pytest.mark.parametrize('period', [1e-6, 1e-3, 5e-3, 1.0])
@pytest.mark.parametrize(
    ('a1', 'a0'),
    [
        (130.0, 4225.0),  # equal poles, 130^2 / 4
        (130.0, 4225.0 * (1 + 1e-12)),
        (130.0, 4225.0 * (1 - 1e-12)),
        (400.0, 0.0),  # an integrator
        (0.0, 4000.0),  # undamped
        (500.0, 1e-6),
        (3.0, 1e8),  # light damping far above the sample rate
        (1e6, 1e6),  # one very fast pole
    ],
)
def test_special_poles(a1, a0, period, hold):
    u = command(50)
    out = linear.respond([[a1, a0, a0 + 1.0]], u, period=period, hold=hold, initial=(1e-3, 0.01))[
        0
    ]
    expected = reference(a1, a0, a0 + 1.0, period, u, hold, (1e-3, 0.01))
    phase = max(1.0, np.sqrt(a0) * period * 50)  # conditioning of cos(w T) itself
    assert relative(out, expected) < 1e-11 * phase + 1e-11


def test_long_high_rate_record_keeps_accuracy():
    """200 000 samples at 10 kHz, poles within 1e-2 of one, against extended precision."""
    n, period = 200_000, 1e-4
    u = command(n, 3)
    wide = np.longdouble
    num, den = linear.discretise(TABLE_2, 250e3, period)
    a1, a0, b0 = linear.systems(TABLE_2, 250e3)[0].astype(wide)
    # Coefficients in extended precision from the two real or complex poles.
    root = np.sqrt((a1 * a1 / 4 - a0).astype(np.clongdouble))
    p1, p2 = -a1 / 2 + root, -a1 / 2 - root
    z1, z2 = np.exp(p1 * wide(period)), np.exp(p2 * wide(period))

    def h(t):
        return b0 / a0 * (1 + (p2 * np.exp(p1 * t) - p1 * np.exp(p2 * t)) / (p1 - p2))

    c1, c2 = (z1 + z2).real, -(z1 * z2).real
    h1, h2 = h(wide(period)).real, h(wide(2 * period)).real
    g1, g2 = h1, h2 - h1 - c1 * h1
    np.testing.assert_allclose(num[1:].astype(float), [g1, g2], rtol=1e-11)
    np.testing.assert_allclose(den.astype(float), [1.0, -c1, -c2], rtol=1e-15)
    ours = linear.simulate(TABLE_2, u, stiffness=250e3, period=period)
    y = np.zeros(n, dtype=wide)
    for i in range(2, n):
        y[i] = c1 * y[i - 1] + c2 * y[i - 2] + g1 * u[i - 1] + g2 * u[i - 2]
        if i == 2:
            y[1] = g1 * u[0]
            y[2] = c1 * y[1] + g1 * u[1] + g2 * u[0]
    assert relative(ours, y.astype(float)) < 1e-11


def test_every_corner_of_the_prior_is_safe():
    corners = np.array(np.meshgrid(*zip(LOWER, UPPER, strict=True))).reshape(4, -1).T
    for stiffness in (0.0, 250e3):
        for hold in HOLDS:
            x = linear.simulate(corners, command(100), stiffness=stiffness, period=1e-3, hold=hold)
            exists = (corners[:, 2] + stiffness) > 0
            assert np.isfinite(x[exists]).all()
            assert not np.isfinite(x[~exists, 1:]).any()  # sample 0 is the initial state


def test_stiffness_shapes_and_frequency_response():
    many = np.stack([TABLE_2, 1.1 * TABLE_2])
    f = np.array([1.0, 5.0, 10.0])
    both = linear.frequency_response(many, 250e3, f)
    assert both.shape == (2, 3)
    np.testing.assert_array_equal(both[0], linear.frequency_response(TABLE_2, 250e3, f))
    system = control.tf(*transfer(TABLE_2, 250e3))
    np.testing.assert_allclose(both[0], system(2j * np.pi * f), rtol=1e-12)
    assert linear.simulate(many, command(10), stiffness=0.0, period=0.01).shape == (2, 10)
    with pytest.raises(InputError, match='theta has shape'):
        linear.simulate([1.0, 2.0], command(10), stiffness=0.0, period=0.01)
    with pytest.raises(InputError, match='stiffness'):
        linear.coefficients(TABLE_2, -1.0)


def test_table_2_gives_the_printed_second_order_form():
    """At k = 0: d1/d2 = beta_1, n0/d2 = 4174; at 250 kN/m the static gain is just below one."""
    n0, d2, d1, d0 = linear.coefficients(TABLE_2, 0.0)
    assert d1 / d2 == pytest.approx(128.0)
    assert n0 / d2 == pytest.approx(4174, rel=1e-3)
    n0, d2, d1, d0 = linear.coefficients(TABLE_2, 250e3)
    assert n0 / d0 == pytest.approx(0.9981, abs=1e-4)


def test_initial_state_recovers_a_straight_motion():
    t = np.arange(100) * 1e-3
    record = Record(np.zeros(100), 1e-3 + 0.2 * t, 1e-3)
    assert linear.initial_state(record) == pytest.approx((1e-3, 0.2))
