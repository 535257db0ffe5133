"""Priors from earlier draws: the density, its drift, its use by the sampler, and its check."""

import json

import numpy as np
import pytest
from scipy.stats import kstest, multivariate_normal

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried, Drift
from actuator_glue.inference.choice import choose_model
from actuator_glue.inference.compiled import log_densities, scratch
from actuator_glue.inference.informative_prior import informative_prior
from actuator_glue.inference.mixture_density import (
    components,
    covariance,
    fitted,
    log_mixtures,
    sampled,
)
from actuator_glue.inference.posterior import Problem, _Density, sample
from actuator_glue.inference.prior_conflict import SequentialTest, conflict
from actuator_glue.model import reference_problem
from actuator_glue.model.parameters import NAMES

MODEL = choose_model()
TRUTH = np.array([134.0, 1.1e9, 2.5e5, 0.5])
SPREAD = np.array([0.02, 0.03, 0.04, 0.1])


def carried(seed: int = 0, count: int = 800, middle=TRUTH) -> Carried:
    """Draws around the truth, lognormal."""
    steps = np.random.default_rng(seed).standard_normal((count, 4))
    return Carried(NAMES, middle * np.exp(SPREAD * steps))


def prior(known: Carried, stiffness=None, model=MODEL):
    return informative_prior(known, model.names, model.lower, model.upper, stiffness)


def test_a_mixture_is_what_scipy_says():
    rng = np.random.default_rng(1)
    z = np.concatenate([rng.normal(-4.0, 1.0, (300, 2)), rng.normal(4.0, 0.5, (300, 2))])
    assert components(z, 4) == 2
    mixture = fitted(z, 2)
    mean, spread = covariance(mixture)
    assert np.allclose(mean, z.mean(axis=0), atol=0.1)
    assert np.allclose(spread, np.cov(z.T), rtol=0.05, atol=0.1)
    parts = [
        multivariate_normal(m, np.linalg.inv(w) @ np.linalg.inv(w).T).pdf(z)
        for m, w in zip(mixture.means, mixture.whiten, strict=True)
    ]
    shares = np.bincount(sampled(mixture, 20_000, rng)[:, 0] > 0.0) / 20_000
    weights = [shares[0], shares[1]] if mixture.means[0, 0] < 0 else [shares[1], shares[0]]
    # Shares of 20 000 draws: five standard deviations are 0.018.
    expected = np.log(0.5 * parts[0] + 0.5 * parts[1])
    assert np.abs(log_mixtures(mixture, z) - expected).max() < 0.05
    assert np.allclose(weights, 0.5, atol=0.018)


@pytest.mark.parametrize('stiffness', [None, 0.0, 250e3])
def test_the_density_is_normalised_in_the_physical_parameters(stiffness):
    """Importance sampling with the draws' own lognormal: the weights' mean is the integral."""
    known = carried(count=4000)
    found = prior(known, stiffness)
    rng = np.random.default_rng(3)
    wide = 1.5 * SPREAD
    steps = rng.standard_normal((20_000, 4))
    x = TRUTH * np.exp(wide * steps)
    log_proposal = (-0.5 * steps**2 - np.log(wide) - 0.5 * np.log(2 * np.pi)).sum(axis=1)
    log_weight = found.log_density(x) - (log_proposal - np.log(x).sum(axis=1))
    # Jacobians are known up to a constant: the spread of the weights tells whether the shape is.
    weight = np.exp(log_weight - log_weight.max())
    mean = (weight[:, np.newaxis] * np.log(x / TRUTH)).sum(axis=0) / weight.sum()
    sd = np.sqrt((weight[:, np.newaxis] * np.log(x / TRUTH) ** 2).sum(axis=0) / weight.sum())
    # At least 5000 effective draws; alpha_3 is clipped by nothing here.
    assert np.all(np.abs(mean) < 0.1 * SPREAD)
    assert np.allclose(sd, SPREAD, rtol=0.08)
    assert found.quality() < 0.01


@pytest.mark.parametrize('stiffness', [0.0, 250e3])
def test_the_compiled_density_is_the_python_one(stiffness):
    record = reference_problem.records()[int(stiffness > 0)].slice(500, 2500)
    target = Problem((record,), MODEL, initial='measured', settle=0.2, prior=carried()).target()
    density = _Density(target.log_likelihood, target.transform, target.prior)
    form = density.compiled()
    z = target.transform.forward(carried(5, 64).draws)
    values, inside = np.empty(64), np.zeros(64)
    room = scratch(len(form.rows), 64)
    log_densities(form, z, inside, np.full(64, -np.inf), values, room)
    expected = density(z)
    assert np.allclose(values - values[0], expected - expected[0], rtol=0, atol=1e-6)


def test_drift_adds_to_the_variance_of_logarithms():
    known = carried()
    later = known.drifted(Drift.of(0.01, {'beta_1': 0.1}), 4 * 3600.0)
    assert np.allclose(later.spread, [0.2, 0.02, 0.02, 0.02])
    # The mixture is held against the draws as they were: drift makes it no worse a fit.
    assert prior(later).quality() == prior(known).quality() < 0.01
    again = known.drifted(Drift(0.01), 3600.0).drifted(Drift(0.01), 3 * 3600.0)
    assert np.allclose(again.spread, 0.02)
    for stiffness in (None, 250e3):
        first, second = prior(known, stiffness), prior(later, stiffness)
        wanted = np.sqrt(SPREAD**2 + np.array(later.spread) ** 2)
        z = sampled(second.mixture, 4000, np.random.default_rng(0))
        x = second.transform.inverse(z)[0]
        # 4000 draws: a standard deviation is known to 1.1 %.
        assert np.allclose(np.log(x).std(axis=0), wanted, rtol=0.08)
        assert second.mixture.means.shape == first.mixture.means.shape
    wider = covariance(prior(known.widened(4.0)).mixture)[1]
    assert np.allclose(wider, 4.0 * covariance(prior(known).mixture)[1])


def test_the_sampler_finds_prior_times_likelihood():
    """Where the record says nothing the prior is what is left; else both are narrower."""
    record = reference_problem.records()[0].slice(0, 4000)
    known = carried()
    target = Problem((record,), MODEL, initial='rest', prior=known).target()
    chains = sample(target, (1,), 30_000)
    logs = np.log(chains.posterior())
    # k = 0 says nothing of alpha_3, and leaves the prior of it: 2000 draws or more.
    assert abs(logs[:, 3].std() / SPREAD[3] - 1.0) < 0.15
    assert np.all(logs.std(axis=0) < 1.1 * SPREAD)


def test_conflict_is_uniform_where_the_prior_holds():
    """Normal prior, normal data: the posterior is known, and p-values are uniform.

    400 of them, Kolmogorov-Smirnov: fails by chance once in 1000 runs.
    """
    rng = np.random.default_rng(11)
    found = prior(carried(count=4000))
    mean, spread = covariance(found.mixture)
    told = np.diag([0.5, 0.2, 0.05, 0.3]) @ spread
    told = 0.5 * (told + told.T)
    gain = spread @ np.linalg.inv(spread + told)
    after = np.linalg.cholesky(spread - gain @ spread)
    p_values = []
    for _ in range(400):
        truth = rng.multivariate_normal(mean, spread)
        middle = mean + gain @ (rng.multivariate_normal(truth, told) - mean)
        z = middle + rng.standard_normal((2000, 4)) @ after.T
        p_values.append(conflict(found, found.transform.inverse(z)[0]).p_value)
    assert kstest(p_values, 'uniform').pvalue > 1e-3


def test_a_prior_that_is_wrong_is_told():
    found = prior(carried(count=4000))
    steps = np.log(carried(7, 2000).draws / TRUTH)
    shifted = TRUTH * np.exp(0.1 * steps + np.array([0.1, 0.0, 0.0, 0.0]))
    assert conflict(found, shifted).p_value < 1e-4
    same = carried(8, 2000).draws
    assert conflict(found, same).directions == 0 and conflict(found, same).p_value == 1.0


def test_false_alarms_are_as_rare_as_promised():
    """Uniform p-values, threshold for one alarm per 200 windows at most.

    Over 100 000 windows at most 500 are expected; 600 would be four standard deviations more.
    """
    test, alarms = SequentialTest(windows=200.0, false_alarms=1.0), 0
    for i, p in enumerate(np.random.default_rng(2).random(100_000)):
        if test.add(p, i):
            alarms += 1
            test.restart()
    assert 0 < alarms < 600


def test_a_change_is_dated():
    test = SequentialTest(windows=800.0, false_alarms=0.1)
    rng = np.random.default_rng(4)
    for i in range(200):
        assert not test.add(float(rng.uniform(0.1, 1.0)), i)
    alarm = next(i for i in range(200, 260) if test.add(1e-4, i))
    assert alarm <= 204 and 197 <= test.since <= 200


def test_draws_survive_json_to_the_last_bit():
    known = carried().drifted(Drift(0.1), 60.0).widened(2.0)
    again = Carried.from_json(json.loads(json.dumps(known.to_json())))
    assert again == known and again.draws.tobytes() == known.draws.tobytes()


def test_a_model_with_more_parameters_keeps_the_rest_uniform():
    model = choose_model(['backlash'])
    found = prior(carried(), 250e3, model)
    points = found.points(model.bounds, 4000, (1,))
    last = (points[:, 4] - model.lower[4]) / (model.upper[4] - model.lower[4])
    assert kstest(last, 'uniform').pvalue > 1e-4
    assert np.allclose(np.log(points[:, :4]).std(axis=0), SPREAD, rtol=0.1)


@pytest.mark.parametrize(
    ('make', 'told'),
    [
        (lambda: Carried(NAMES, np.ones((10, 4))), 'needs draws'),
        (lambda: Carried(NAMES, np.full((100, 4), np.nan)), 'not all finite'),
        (lambda: Carried.from_json({'names': ['a']}, 'file'), 'file: the carried prior'),
        (lambda: Drift(-1.0), 'drift of every parameter'),
        (lambda: prior(Carried(('x',), np.ones((60, 1)))), 'the model has none of them'),
        (
            lambda: prior(carried(), None, choose_model((), {'beta_1': (0.0, 130.0)})),
            'outside the bounds of beta_1',
        ),
        (lambda: SequentialTest(10.0, 0.0), 'must be positive'),
    ],
)
def test_what_cannot_be_a_prior_is_refused(make, told):
    with pytest.raises(InputError, match=told):
        make()
