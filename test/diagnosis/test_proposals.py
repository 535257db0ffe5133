"""What importance sampling of a posterior begins with."""

import numpy as np
import pytest
from scipy import stats

from actuator_glue.diagnosis.posterior import proposals
from actuator_glue.diagnosis.posterior.discrepancy import ScaleMixture
from actuator_glue.inference import importance

LEAST, MEAN, SD = 1e-6, 0.02, 0.05


@pytest.mark.parametrize('seed', range(3))
def test_a_leakage_that_may_be_nothing_is_drawn(seed: int) -> None:
    """Normal but for a prior uniform in its logarithm, beside a parameter that goes with it.

    Half of the mass is below a thousandth of what the records tell from nothing. Four standard
    errors: once in 5000 runs by chance.
    """
    mean, covariance = np.array([0.0, 0.0, 0.0, MEAN]), np.diag([1.0, 1.0, 1.0, SD**2])
    covariance[0, 3] = covariance[3, 0] = 0.95 * SD
    parts, bent = proposals._near_zero(
        ScaleMixture(np.ones(1), mean[None], covariance[None]), LEAST
    )
    start = importance.StudentMixture(
        parts.weights, parts.means, np.array([np.linalg.cholesky(c) for c in parts.covariances])
    )
    normal = stats.multivariate_normal(mean, covariance)

    def density(z: np.ndarray) -> np.ndarray:
        y, log_jacobian = bent.inverse(z)
        with np.errstate(divide='ignore'):
            possible = np.where(y[:, 3] >= LEAST, 0.0, -np.inf)
        return normal.logpdf(y) - np.log(y[:, 3]) + log_jacobian + possible

    found, _ = importance.sample(np.random.default_rng(seed), density, start, 400.0)
    assert found is not None
    drawn = bent.inverse(found.points)[0]
    s = np.geomspace(LEAST, MEAN + 8.0 * SD, 4000)
    mass = stats.norm(MEAN, SD).pdf(s) * np.gradient(np.log(s))
    mass /= mass.sum()
    shift = 0.95 / SD * (s - MEAN)
    for got, expected, spread in (
        (drawn[:, 3], mass @ s, np.sqrt(mass @ s**2)),
        (np.log(drawn[:, 3]), mass @ np.log(s), np.sqrt(mass @ np.log(s) ** 2)),
        (drawn[:, 0], mass @ shift, np.sqrt(1.0 + mass @ shift**2)),
    ):
        assert got.mean() == pytest.approx(expected, abs=4.0 * spread / np.sqrt(400.0))


@pytest.mark.parametrize(('mean', 'exact'), [(0.5, 0.02), (-1.0, 0.03), (-6.0, 0.03)])
def test_parts_have_the_moments_that_they_have_between_bounds(mean: float, exact: float) -> None:
    """Most of one may lie beyond; another coordinate goes with it, a third has no bound."""
    covariance = np.array([[1.0, 0.6, 0.0], [0.6, 2.0, 0.3], [0.0, 0.3, 0.5]])
    centre, lower = np.array([mean, 1.0, 0.0]), np.array([0.0, -np.inf, -np.inf])
    parts = ScaleMixture(np.ones(1), centre[None], covariance[None])
    found = proposals._cut(parts, lower, np.full(3, np.inf))
    rng = np.random.default_rng(4)
    first = stats.truncnorm.rvs(-mean, np.inf, loc=mean, size=400_000, random_state=rng)
    slope = covariance[0] / covariance[0, 0]
    rest = covariance - np.outer(slope, slope) * covariance[0, 0]
    drawn = rng.multivariate_normal(centre, rest, len(first)) + np.outer(first - mean, slope)
    assert found.means[0] == pytest.approx(drawn.mean(axis=0), abs=exact)
    assert found.covariances[0] == pytest.approx(np.cov(drawn.T), abs=exact)
    assert (parts.means == centre).all()
