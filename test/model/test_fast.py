"""The fast likelihood against the exact kernel: near the best fit, over the prior, any window."""

from __future__ import annotations

import functools
import statistics
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from actuator_glue.errors import InputError
from actuator_glue.model import commands, linear, reference_problem
from actuator_glue.model.fast import FastErrors
from actuator_glue.model.parameters import TABLE_2, bounds
from actuator_glue.records import Record

LOWER, UPPER = bounds()
G = 256.0


def log_likelihood(errors, sums):
    """Eq. (4) from error sums (m, R, 2)."""
    n = errors.sizes.sum()
    total = sums.sum(axis=1)
    return -G * np.log(total[:, 1] / n - (total[:, 0] / n) ** 2)


@functools.cache
def problem():
    return FastErrors(reference_problem.records())


def posterior_draws(m, seed=0):
    """Normal with the moments of the reference posterior; alpha_3 exponential."""
    rng = np.random.default_rng(seed)
    correlation = np.array([[1.0, 0.741, 0.05], [0.741, 1.0, 0.68], [0.05, 0.68, 1.0]])
    draws = rng.multivariate_normal(np.zeros(3), correlation, m)
    first = np.array([133.65, 1.1005e9, 2.4927e5]) + draws * [1.044, 1.128e7, 2.048e3]
    return np.column_stack([first, rng.exponential(0.0059, m)])


def prior_draws(m, seed=0):
    return LOWER + (UPPER - LOWER) * np.random.default_rng(seed).random((m, 4))


def test_posterior_of_problem_r_within_1e_6_without_the_exact_kernel():
    fast = problem()
    theta = posterior_draws(4000)
    before = fast.fallbacks
    ours = log_likelihood(fast, fast(theta))
    exact = log_likelihood(fast, fast.exact(theta))
    assert np.abs(ours - exact).max() < 1e-6
    assert fast.fallbacks == before


def test_whole_prior_within_1e_6():
    fast = problem()
    theta = prior_draws(3000)
    error = log_likelihood(fast, fast(theta)) - log_likelihood(fast, fast.exact(theta))
    assert np.abs(error).max() < 1e-6


def test_corners_of_the_prior_do_not_raise_and_match():
    fast = problem()
    corners = np.array(np.meshgrid(*zip(LOWER, UPPER, strict=True))).reshape(4, -1).T
    sums, exact = fast(corners), fast.exact(corners)
    finite = np.isfinite(exact)
    np.testing.assert_array_equal(np.isfinite(sums), finite)
    np.testing.assert_allclose(sums[..., 1][finite[..., 1]], exact[..., 1][finite[..., 1]], 1e-8)


def window(rate, seconds, hold, stiffness, seed, kind, noise=1e-5):
    """A window cut out of the middle of a test, in motion at its first sample."""
    rng = np.random.default_rng(seed)
    length = 2.0 * seconds + 1.0
    if kind == 'noise':
        u = commands.noise(rate, length, 0.1, min(15.0, rate / 8), 2e-3, seed)
    elif kind == 'earthquake':
        u = commands.earthquake(rate, length, 5e-3, seed)
    else:
        u = commands.sweep(rate, length, 0.5, 10.0)
    theta = TABLE_2 * np.array([*rng.uniform(0.7, 1.4, 3), rng.uniform(0.0, 30.0)])
    x = linear.simulate(theta, u, stiffness=stiffness, period=1 / rate, hold=hold)
    record = Record(u, x + noise * rng.standard_normal(len(u)), 1 / rate, stiffness, hold=hold)
    first = int(0.45 * len(u))
    return theta, record.slice(first, first + int(rate * seconds))


@settings(max_examples=40, deadline=None)
@given(
    rate=st.sampled_from([200.0, 1000.0, 4096.0]),
    seconds=st.floats(1.5, 8.0),
    hold=st.sampled_from(['zoh', 'linear']),
    stiffness=st.sampled_from([0.0, 250e3, 5e6]),
    initial=st.sampled_from(['rest', 'measured']),
    settle=st.floats(0.0, 0.5),
    kind=st.sampled_from(['noise', 'earthquake', 'sweep']),
    seed=st.integers(0, 2**16),
)
def test_any_window_agrees_with_the_exact_kernel(
    rate, seconds, hold, stiffness, initial, settle, kind, seed
):
    theta, record = window(rate, seconds, hold, stiffness, seed, kind)
    fast = FastErrors([record], int(settle * rate), initial)
    rng = np.random.default_rng(seed)
    near = theta * np.exp(0.03 * rng.standard_normal((40, 4)))
    far = theta * np.exp(1.0 * rng.standard_normal((40, 4)))
    for thetas in (near, np.clip(far, LOWER, UPPER), near[:1]):
        ours, right = (log_likelihood(fast, of(thetas)) for of in (fast, fast.exact))
        assert np.abs(ours - right).max() < 1e-6


@pytest.mark.parametrize('initial', ['rest', 'measured'])
@pytest.mark.parametrize('hold', ['zoh', 'linear'])
def test_near_the_best_fit_the_exact_kernel_is_not_needed(initial, hold):
    theta, record = window(1000.0, 10.0, hold, 250e3, 3, 'noise')
    fast = FastErrors([record], 500, initial)
    near = theta * np.exp(0.03 * np.random.default_rng(0).standard_normal((500, 4)))
    difference = log_likelihood(fast, fast(near)) - log_likelihood(fast, fast.exact(near))
    assert np.abs(difference).max() < 1e-6
    assert fast.fallbacks == 0


def test_any_hint_gives_the_same_answer():
    """A hint saves the search; a bad or impossible one costs exact evaluations, not accuracy."""
    theta, record = window(1000.0, 5.0, 'zoh', 250e3, 3, 'noise')
    near = theta * np.exp(0.03 * np.random.default_rng(0).standard_normal((50, 4)))
    for hint in (theta, 0.3 * theta, UPPER, LOWER):
        fast = FastErrors([record], 500, 'measured', near=hint)
        difference = log_likelihood(fast, fast(near)) - log_likelihood(fast, fast.exact(near))
        assert np.abs(difference).max() < 1e-6
        if hint is theta:
            assert fast.fallbacks == 0


def test_ten_times_the_length_is_as_accurate():
    fast = FastErrors(reference_problem.records(duration=600.0))
    theta = posterior_draws(300, 1)
    difference = log_likelihood(fast, fast(theta)) - log_likelihood(fast, fast.exact(theta))
    assert np.abs(difference).max() < 1e-6
    assert fast.fallbacks == 0


def test_cost_does_not_grow_with_the_length():
    """Processor time of this thread, medians side by side: flat within half, lfilter's is not."""
    theta, one = posterior_draws(512), posterior_draws(1)[0]
    short, long = (
        FastErrors(reference_problem.records()),
        FastErrors(reference_problem.records(duration=600.0)),
    )

    def lfilter():
        for record in short.exact.records:
            equation = linear.discretise(one, record.stiffness, record.period)
            signal.lfilter(*equation, record.command)

    taken = {short: [], long: [], lfilter: []}
    for _ in range(15):
        for task, times in taken.items():
            began = time.thread_time()
            task() if task is lfilter else task(theta)
            times.append(time.thread_time() - began)
    of_short, of_long, of_lfilter = (statistics.median(times) for times in taken.values())
    assert of_long < 1.5 * of_short
    assert of_short / len(theta) < of_lfilter / 50


def test_result_of_a_theta_does_not_depend_on_its_batch():
    fast = problem()
    theta = np.concatenate([posterior_draws(37), prior_draws(20)])
    np.testing.assert_array_equal(fast(theta), np.stack([fast(one) for one in theta]))


def test_noise_free_records_fall_back_rather_than_lose_digits():
    """At the true theta the residual vanishes: no basis can give its size to nine digits."""
    theta, record = window(1000.0, 4.0, 'zoh', 250e3, 5, 'noise', noise=0.0)
    fast = FastErrors([record], 500, 'rest')
    near = theta * np.exp(1e-4 * np.random.default_rng(0).standard_normal((30, 4)))
    sums, exact = fast(near), fast.exact(near)
    np.testing.assert_allclose(sums[..., 1], exact[..., 1], rtol=1e-6)


@pytest.mark.parametrize('command', [np.zeros(500), np.full(500, 1e-3)])
def test_silent_commands_are_no_special_case(command):
    record = Record(command, 1e-5 * np.random.default_rng(0).standard_normal(500), 1e-3, 250e3)
    fast = FastErrors([record])
    theta = TABLE_2 * np.exp(0.1 * np.random.default_rng(1).standard_normal((20, 4)))
    np.testing.assert_allclose(fast(theta)[..., 1], fast.exact(theta)[..., 1], rtol=1e-7)


def test_refusals_are_those_of_the_exact_errors():
    with pytest.raises(InputError, match='no record'):
        FastErrors([])
    with pytest.raises(InputError, match='theta has shape'):
        problem()(np.zeros(3))
    with pytest.raises(InputError, match='settle'):
        FastErrors(reference_problem.records(), 20_000)


def test_records_of_different_rate_hold_and_length_are_fitted_jointly():
    theta, first = window(200.0, 9.0, 'zoh', 0.0, 1, 'sweep')
    records = [
        first,
        *(
            Record(
                r.command,
                linear.simulate(
                    theta,
                    r.command,
                    stiffness=k,
                    period=r.period,
                    hold=r.hold,
                    initial=(1e-4, 0.0),
                )
                + 1e-5 * np.random.default_rng(2).standard_normal(len(r)),
                r.period,
                k,
                hold=r.hold,
            )
            for k, r in (
                (250e3, window(1000.0, 4.0, 'linear', 250e3, 2, 'noise')[1]),
                (600e3, window(4096.0, 3.0, 'zoh', 600e3, 3, 'earthquake')[1]),
            )
        ),
    ]
    near = theta * np.exp(0.05 * np.random.default_rng(0).standard_normal((200, 4)))
    for initial in ('rest', 'measured'):
        fast = FastErrors(records, [20, 500, 1000], initial)
        difference = log_likelihood(fast, fast(near)) - log_likelihood(fast, fast.exact(near))
        assert np.abs(difference).max() < 1e-6
        counted = [len(r) - s for r, s in zip(records, (20, 500, 1000), strict=True)]
        np.testing.assert_array_equal(fast.sizes, counted)
