"""A calibration as prior of a diagnosis: in its fits, in its posterior, and where it is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from test_diagnose import QUICK, THETA, make

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.refits.global_search import Shares
from actuator_glue.diagnosis.remembered import Before
from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.least_squares.base_prior import BasePrior
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import fit
from actuator_glue.inference.least_squares.space import UPPER, sum_of_squares
from actuator_glue.inference.prior_use import GivenPrior
from actuator_glue.model.parameters import NAMES
from actuator_glue.model.structure import Structure


def known(middle: np.ndarray, spread: float) -> Carried:
    """Draws of a calibration: log-normal about a middle, its parameters tied in part."""
    rng = np.random.default_rng(3)
    steps = rng.standard_normal((600, 4))
    steps[:, 1] = 0.8 * steps[:, 0] + 0.6 * steps[:, 1]
    return Carried(NAMES, middle * np.exp(spread * steps))


def given(carried: Carried) -> GivenPrior:
    """The same with where it came from."""
    return GivenPrior(carried, 'monday.npz', 0.02, 0.0)


def test_fit_and_posterior_have_one_prior() -> None:
    """One component is a normal of the logarithms: density, and the squares that a fit adds."""
    prior = BasePrior(known(THETA, 0.05), UPPER)
    theta = THETA * np.exp(0.1 * np.random.default_rng(1).standard_normal((20, 4)))
    logs = np.log(known(THETA, 0.05).draws)
    normal = multivariate_normal(logs.mean(axis=0), np.cov(logs.T))
    found = prior.log_density(theta)
    expected = normal.logpdf(np.log(theta))
    np.testing.assert_allclose(found - found[0], expected - expected[0], rtol=0.02, atol=0.05)
    square = (prior.pull(np.log(theta)) ** 2).sum(axis=1)
    np.testing.assert_allclose(-0.5 * (square - square[0]), found - found[0], atol=1e-9)
    step = 1e-6 * np.eye(5)[:, :4]
    slopes = (prior.pull(np.log(THETA) + step) - prior.pull(np.log(THETA))) / 1e-6
    np.testing.assert_allclose(slopes[:4], prior.slopes(5)[:4], rtol=1e-6, atol=1e-9)


def test_what_is_not_known_stays_open() -> None:
    """A prior of beta_1 alone pulls and weighs beta_1 alone; one of nothing is an error."""
    prior = BasePrior(known(THETA, 0.05).only(['beta_1']), UPPER)
    moved = THETA * np.exp([0.0, 0.5, -0.5, 1.0])
    assert prior.pull(np.log(moved)) == pytest.approx(prior.pull(np.log(THETA)))
    assert prior.log_density(moved[None]) == pytest.approx(prior.log_density(THETA[None]))
    assert prior.slopes(5).shape == (5, 1)
    assert not prior.slopes(5)[1:].any()
    start = prior.start(moved)
    assert start[0] == pytest.approx(THETA[0], rel=0.01)
    assert start[1:].tolist() == moved[1:].tolist()
    with pytest.raises(InputError, match='none of them'):
        BasePrior(Carried(('backlash',), np.ones((60, 1))), UPPER)


def test_a_fit_ends_at_the_most_probable_parameters() -> None:
    """No neighbour has a smaller N ln SSE + squares of the prior; without it, others do."""
    record = make([], [], 5)[1]
    free = Data.whole([record])
    data = replace(free, prior=BasePrior(known(1.03 * THETA, 0.02), UPPER))
    model = Structure()

    def cost(theta: np.ndarray) -> np.ndarray:
        sums = sum_of_squares(data.target - data.simulate(model, theta))
        assert data.prior is not None
        return len(data.target) * np.log(sums) + (data.prior.pull(np.log(theta)) ** 2).sum(axis=-1)

    found, plain = fit(data, model, THETA), fit(free, model, THETA)
    around = found.theta * np.exp(2e-3 * np.random.default_rng(2).standard_normal((40, 4)))
    assert (cost(around) > cost(found.theta[None]) - 1e-3).all()
    assert cost(plain.theta[None]) > cost(found.theta[None]) + 0.1


def test_a_prior_is_the_same_in_shares_of_the_oil() -> None:
    """Refits of friction ended with a thousand times its force: the prior took shares for logs."""
    record = make(['coulomb-friction'], [150.0], 5)[1]
    free, model = Data.whole([record]), Structure(('coulomb-friction',))
    data = replace(free, prior=BasePrior(known(1.01 * THETA, 0.02), UPPER))
    space = Shares(model, data.duration, record.known_stiffness())
    theta = np.array([*(1.02 * THETA), 140.0])
    z = space.z(theta)
    np.testing.assert_allclose(space.logs(z), np.log(theta[:4]), rtol=1e-12)
    moved = space.logs(z + 1e-6 * np.eye(5)) - space.logs(z)
    np.testing.assert_allclose(moved / 1e-6, space.log_slopes(z), rtol=1e-4, atol=1e-6)
    usual, shares = (fit(data, model, theta, space=s) for s in (None, space))
    # Over the kinks of friction either ends within a percent or so.
    np.testing.assert_allclose(shares.theta, usual.theta, rtol=0.02)
    assert usual.theta[4] == pytest.approx(150.0, rel=0.05)


@pytest.mark.slow
def test_what_one_stiffness_leaves_open_is_known_from_the_calibration() -> None:
    """Base parameters about as wide as the prior at most, and right; the effect is still named."""
    record = make(['backlash'], [6e-5], 31)[1]
    alone = diagnose([record], settings=QUICK, seed=2)
    found = diagnose([record], settings=QUICK, seed=2, before=Before(given(known(THETA, 0.05))))
    assert [e.name for e in found.effects] == ['backlash']
    for i, name in enumerate(NAMES):
        told, before = found.base[name], alone.base[name]
        assert told.stddev < 0.07 * told.mean
        assert told.mean == pytest.approx(THETA[i], abs=5.0 * told.stddev)
        assert told.upper - told.lower < 1.05 * (before.upper - before.lower)
    assert alone.base['alpha_3'].stddev > 3.0 * found.base['alpha_3'].stddev
    assert found.prior is not None and not found.prior.contradicted
    assert any(line.startswith('prior from monday.npz') for line in found.advice)
    assert found.to_json()['prior']['source'] == 'monday.npz' and alone.prior is None


@pytest.mark.usefixtures('few_forms', 'few_names')
def test_a_prior_that_is_wrong_is_told_first() -> None:
    """An actuator that is softer by a tenth than a calibration to one per cent says."""
    records = make([], [], 7)
    before = Before(given(known(THETA * [1, 1, 1.1, 1], 0.01)))
    found = diagnose(records[:2], records[2], settings=QUICK, before=before)
    assert found.prior is not None and found.prior.contradicted
    assert found.advice[0].startswith('the records contradict the prior from monday.npz')
