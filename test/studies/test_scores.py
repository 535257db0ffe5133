"""Coverage, CRPS and interval score against an independent library and closed forms."""

import itertools

import numpy as np
import pytest
from scipy.stats import norm

from actuator_glue.errors import InputError
from actuator_glue.inference.bands import Band, band
from actuator_glue.report.frequency import instantaneous_frequency
from studies.chen.scores import coverage, crps_ensemble, interval_score, mean_width, score


@pytest.mark.slow
def test_crps_of_ensemble_agrees_with_scoringrules(rng_seed: int) -> None:
    import scoringrules  # compiles for ten seconds

    rng = np.random.default_rng(rng_seed)
    observed, draws = rng.normal(size=200), rng.standard_t(3, size=(37, 200))
    expected = scoringrules.crps_ensemble(observed, draws.T, estimator='nrg')
    np.testing.assert_allclose(crps_ensemble(observed, draws), expected, rtol=1e-10)


def test_crps_taken_in_blocks_changes_nothing() -> None:
    rng = np.random.default_rng(4)
    observed, draws = rng.normal(size=4100), rng.normal(size=(5, 4100))
    whole = crps_ensemble(observed, draws)
    part = crps_ensemble(observed[4090:], draws[:, 4090:])
    np.testing.assert_allclose(whole[4090:], part, rtol=1e-12)


def test_crps_is_the_integral_of_its_definition() -> None:
    rng = np.random.default_rng(2)
    draws = rng.normal(size=(6, 1))
    observed = 0.3
    grid = np.sort(np.concatenate([draws[:, 0], [observed]]))
    expected = 0.0
    for low, high in itertools.pairwise(grid):
        cdf = (draws[:, 0] <= low).mean()
        expected += (cdf - (low >= observed)) ** 2 * (high - low)
    assert crps_ensemble(np.array([observed]), draws)[0] == pytest.approx(expected)


@pytest.mark.slow
def test_interval_score_agrees_with_scoringrules(rng_seed: int) -> None:
    import scoringrules  # compiles for ten seconds

    rng = np.random.default_rng(rng_seed)
    observed = rng.normal(size=50)
    lower = rng.normal(size=50) - 1
    upper = lower + rng.random(50)
    np.testing.assert_allclose(
        interval_score(observed, lower, upper, 0.9),
        scoringrules.interval_score(observed, lower, upper, 0.1),
        rtol=1e-12,
    )


def test_interval_score_is_least_for_the_true_quantiles() -> None:
    observed = np.random.default_rng(7).normal(size=200_000)
    exact = norm.ppf(0.95)

    def mean_score(limit: float) -> float:
        full = np.full(len(observed), limit)
        return float(interval_score(observed, -full, full, 0.9).mean())

    assert mean_score(exact) < min(mean_score(0.9 * exact), mean_score(1.1 * exact))


def test_scores_by_frequency_band_add_up() -> None:
    rng = np.random.default_rng(8)
    time = np.arange(0, 30, 0.01)
    frequency = time / 6  # 0 to 5 Hz
    draws = rng.normal(size=(200, len(time)))
    observed = rng.normal(size=len(time)) * np.where(frequency < 2.5, 1.0, 2.0)
    parts = score(
        observed,
        band(draws),
        crps=crps_ensemble(observed, draws),
        frequency_hz=frequency,
        edges_hz=(0, 2.5, 5.1, 9.0),
    )
    whole, low, high = parts  # the empty range 5.1-9 Hz is left out
    assert (low.low_hz, low.high_hz, high.high_hz) == (0, 2.5, 5.1)
    assert low.samples + high.samples == whole.samples == len(time)
    for name in ('coverage', 'mean_width', 'crps', 'interval_score'):
        mixed = (getattr(low, name) * low.samples + getattr(high, name) * high.samples) / len(time)
        assert getattr(whole, name) == pytest.approx(mixed)
    assert low.coverage > 0.9 > high.coverage
    assert low.crps < high.crps


def test_coverage_counts_the_limits_as_inside() -> None:
    assert coverage(np.array([0.0, 1.0, 2.0]), np.zeros(3), np.ones(3)) == pytest.approx(2 / 3)
    assert mean_width(np.zeros(3), np.array([1.0, 2.0, 3.0])) == 2.0


def test_frequency_of_a_sweep_and_of_a_one_sided_noisy_sine() -> None:
    time = np.arange(0, 60, 1 / 500)
    sweep = 2e-3 * np.sin(np.pi * 10 / 60 * time**2)
    found = instantaneous_frequency(sweep, 1 / 500)
    settled = time > 3
    np.testing.assert_allclose(found[settled], time[settled] / 6, rtol=0.08, atol=0.05)
    noisy = -2e-3 + 2e-3 * np.sin(2 * np.pi * 3 * time)
    noisy += 3e-5 * np.random.default_rng(1).normal(size=len(time))
    np.testing.assert_allclose(instantaneous_frequency(noisy, 1 / 500), 3.0, atol=0.15)


def test_unusable_input_says_what_is_wrong() -> None:
    three = np.zeros(3)
    with pytest.raises(InputError, match='equally long'):
        coverage(three, three, np.zeros(4))
    with pytest.raises(InputError, match='observed'):
        crps_ensemble(three, np.zeros((4, 2)))
    with pytest.raises(InputError, match='level'):
        interval_score(three, three, three, 95.0)
    flat = Band(np.array([0.95]), three[None], three, three[None])
    with pytest.raises(InputError, match='frequency'):
        score(three, flat, edges_hz=(0, 1))
    with pytest.raises(InputError, match='crosses'):
        instantaneous_frequency(np.linspace(0, 1, 50), 0.01)
