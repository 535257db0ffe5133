"""The residual model and the total predictive band."""

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_glue.errors import InputError
from actuator_glue.inference.predictive import fit_residual, predictive_draws, total_band
from studies.chen.scores import coverage


def ar1(rng: np.random.Generator, count: int, sd: float, phi: float) -> np.ndarray:
    shock = rng.standard_normal(count) * sd
    shock[1:] *= np.sqrt(1 - phi**2)
    return np.asarray(lfilter([1.0], [1.0, -phi], shock))


@pytest.mark.parametrize('phi', [0.0, 0.8, -0.4])
def test_residual_model_is_recovered(rng_seed: int, phi: float) -> None:
    # Bounds are 5 standard errors of each estimate: false-failure rate about 2e-6 in all.
    rng = np.random.default_rng(rng_seed)
    count, sd, mean = 20_000, 2e-5, 5e-6
    parts = np.split(mean + ar1(rng, count, sd, phi), [7000])
    found = fit_residual(parts)
    assert abs(found.phi - phi) < 5 * np.sqrt((1 - phi**2) / count) + 1e-3
    assert abs(found.sd / sd - 1) < 5 / np.sqrt(2 * found.freedom)
    assert abs(found.mean - mean) < 5 * sd * np.sqrt((1 + phi) / (1 - phi) / count)
    assert found.mean_sd == pytest.approx(
        sd * np.sqrt((1 + phi) / (1 - phi) / count), rel=0.1 + abs(phi) / 5
    )


def test_uncertainty_of_level_and_mean_is_calibrated(rng_seed: int) -> None:
    # Short coloured residuals, so that the uncertainty of mean and sd matters: over 400 cases of
    # one new sample each the 90 % band covers 360 +- 6 (binomial); 4 sd: false failure 6e-5.
    # The AR(1) estimate from 60 samples is biased low, hence the 2 % below.
    rng = np.random.default_rng(rng_seed)
    inside = []
    for _ in range(400):
        path = 1.0 + ar1(rng, 400, 0.5, 0.5)
        limits = total_band(rng, np.zeros((2, 1)), fit_residual(path[:60]), [0.9])
        lower, upper = limits.at(0.9)
        inside.append(coverage(path[-1:], lower, upper))
    spread = np.sqrt(0.9 * 0.1 / 400)
    assert 0.9 - 0.02 - 4 * spread < np.mean(inside) < 0.9 + 4 * spread


def test_paths_have_the_residuals_correlation_and_each_draws_mean(rng_seed: int) -> None:
    # Means of 300 paths of 500 samples: 5 standard errors and more everywhere.
    rng = np.random.default_rng(rng_seed)
    model = fit_residual(ar1(rng, 50_000, 1.0, 0.9))
    draws = np.repeat([[0.0], [100.0]], 150, axis=0) * np.ones(500)
    paths = predictive_draws(rng, draws, model)
    deviation = paths - np.round(paths / 100.0) * 100.0
    assert np.mean(deviation[:, 1:] * deviation[:, :-1]) / np.mean(deviation**2) == pytest.approx(
        0.9, abs=0.02
    )
    # Of n samples that are correlated so a variance is known as well as of n/19: of the residual,
    # which the model has its variance from, and of the paths.
    known = np.sqrt(2 * 19 * (1 / 50_000 + 1 / (300 * 500)))
    assert np.mean(deviation**2) == pytest.approx(1.0, abs=5 * known)


def test_a_perfect_fit_has_a_residual_model() -> None:
    model = fit_residual(np.zeros(20))
    assert (model.mean, model.sd, model.phi) == (0.0, 0.0, 0.0)


def test_unusable_residuals_say_what_is_wrong() -> None:
    with pytest.raises(InputError, match='too few'):
        fit_residual(np.zeros(9), parameters=4)
    with pytest.raises(InputError, match='NaN'):
        fit_residual(np.array([np.nan] * 20))
