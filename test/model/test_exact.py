"""Sums of errors against sample-by-sample simulation and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from actuator_glue.errors import InputError
from actuator_glue.model import linear
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import TABLE_2, bounds
from actuator_glue.records import Record

LOWER, UPPER = bounds()


def make_record(n, seed, stiffness=250e3, hold='zoh', rate=200.0, scale=2e-3):
    rng = np.random.default_rng(seed)
    u = scale * np.sin(np.cumsum(rng.uniform(0, 20.0 * 2 * np.pi / rate, n)))
    theta = TABLE_2 * rng.uniform(0.8, 1.2, 4)
    x = linear.simulate(theta, u, stiffness=stiffness, period=1 / rate, hold=hold)
    return Record(u, x + 1e-5 * rng.standard_normal(n), 1 / rate, stiffness, hold=hold)


@settings(max_examples=40, deadline=None)
@given(
    n=st.integers(5, 700),
    m=st.integers(1, 70),
    settle=st.integers(0, 3),
    hold=st.sampled_from(['zoh', 'linear']),
    initial=st.sampled_from(['rest', 'measured']),
    seed=st.integers(0, 2**16),
)
def test_sums_equal_those_of_the_residuals(n, m, settle, hold, initial, seed):
    records = [make_record(n, seed, hold=hold), make_record(n + 3, seed + 1, stiffness=0.0)]
    errors = ExactErrors(records, [settle, 0], initial)
    theta = TABLE_2 * np.random.default_rng(seed).uniform(0.5, 2.0, (m, 4))
    sums = errors(theta)
    assert sums.shape == (m, 2, 2)
    np.testing.assert_array_equal(errors.sizes, [n - settle, n + 3])
    for r, e in enumerate(errors.residuals(theta)):
        assert e.shape == (m, errors.sizes[r])
        size = np.abs(e).max() * len(e[0])
        np.testing.assert_allclose(sums[:, r, 0], e.sum(axis=1), atol=1e-12 * size)
        np.testing.assert_allclose(sums[:, r, 1], (e**2).sum(axis=1), rtol=1e-11)


def test_sums_agree_with_lfilter_on_problem_r_size():
    record = make_record(12_001, 5)
    num, den = linear.discretise(TABLE_2, 250e3, record.period)
    e = record.measured - signal.lfilter(num, den, record.command)
    sums = ExactErrors([record])(TABLE_2)
    assert sums.shape == (1, 2)
    assert sums[0, 1] == pytest.approx((e**2).sum(), rel=1e-9)
    assert sums[0, 0] == pytest.approx(e.sum(), abs=1e-9 * np.abs(e).sum())


@pytest.mark.parametrize('rate', [1000.0, 10_000.0])
def test_log_likelihood_agrees_with_extended_precision_at_high_rates(rate):
    """60 000 samples, residual near the noise: L = -256 ln Var within 1e-6."""
    record = make_record(60_000, 7, rate=rate)
    num, den = (c.astype(np.longdouble) for c in linear.discretise(TABLE_2, 250e3, 1 / rate))
    u, y = record.command.astype(np.longdouble), np.zeros(60_000, dtype=np.longdouble)
    y[1] = num[1] * u[0]
    for i in range(2, len(u)):
        y[i] = -den[1] * y[i - 1] - den[2] * y[i - 2] + num[1] * u[i - 1] + num[2] * u[i - 2]
    expected = -256 * np.log(np.var((record.measured - y).astype(float)))
    s, q = ExactErrors([record])(TABLE_2)[0]
    n = len(record)
    assert -256 * np.log(q / n - (s / n) ** 2) == pytest.approx(expected, abs=1e-6)


def test_result_of_a_theta_does_not_depend_on_its_batch():
    errors = ExactErrors([make_record(1001, 1), make_record(1001, 2, 0.0)])
    theta = TABLE_2 * np.random.default_rng(0).uniform(0.5, 2.0, (75, 4))
    together = errors(theta)
    alone = np.stack([errors(one) for one in theta])
    np.testing.assert_array_equal(together, alone)


def test_singular_and_extreme_thetas_do_not_raise():
    errors = ExactErrors([make_record(500, 1, 0.0), make_record(500, 2)])
    corners = np.array(np.meshgrid(*zip(LOWER, UPPER, strict=True))).reshape(4, -1).T
    sums = errors(corners)
    singular = corners[:, 2] == 0.0
    assert not np.isfinite(sums[singular, 0, 1]).any()
    assert np.isfinite(sums[:, 1]).all()
    assert np.isfinite(sums[~singular]).all()


def test_measured_start_is_better_than_rest_in_the_middle_of_a_record():
    record = make_record(4000, 3, rate=1000.0).slice(1500, 4000)
    rest, measured = (
        ExactErrors([record], initial=start)(TABLE_2)[0, 1] for start in ('rest', 'measured')
    )
    assert measured < rest


def test_bad_input_is_one_clear_error():
    record = make_record(50, 1)
    with pytest.raises(InputError, match='no record'):
        ExactErrors([])
    with pytest.raises(InputError, match='settle of 49 samples leaves'):
        ExactErrors([record], 49)
    with pytest.raises(InputError, match='settle'):
        ExactErrors([record], [1, 2])
    with pytest.raises(InputError, match='initial'):
        ExactErrors([record], initial='nonsense')
    with pytest.raises(InputError, match='stiffness is not known'):
        ExactErrors([Record(np.zeros(5), np.zeros(5), 0.1)])
