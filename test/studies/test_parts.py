"""The pieces between data and report: residual, convergence, shaping factor, misfit, coverage."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import norm

from actuator_glue.inference.chains import Chains
from actuator_glue.inference.likelihood import GlueLikelihood
from actuator_glue.model import reference_problem
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import TABLE_2
from studies.chen import findings, misfit, shaping, table_spread
from studies.chen.calibration import simulated_case
from studies.chen.convergence import evaluations_at, gelman_rubin
from studies.chen.laboratory import AddedResidual, Laboratory
from studies.chen.published import CHOSEN, TABLE_4
from studies.chen.words import listed, num, percent, power_of_two


def test_added_residual_is_what_white_noise_does_on_average(rng_seed: int) -> None:
    # Mean of 30 noise realisations of Var[E]: relative sd sqrt(2/24002/30) = 0.0017; 6 sd allowed.
    rng = np.random.default_rng(rng_seed)
    records = reference_problem.records(1)
    theta, size = TABLE_2[None], 0.3e-3
    expected = GlueLikelihood(AddedResidual(ExactErrors(records), size), 1.0)(theta)[0]
    variances = []
    for _ in range(30):
        noisy = table_spread.altered(
            records, lambda r: r.measured + size * rng.standard_normal(len(r))
        )
        variances.append(np.exp(-GlueLikelihood(noisy, 1.0)(theta)[0]))
    assert np.mean(variances) == pytest.approx(np.exp(-expected), rel=0.01)


@pytest.mark.slow
def test_spread_of_table_4_is_met_at_about_0_7_mm(rng_seed: int) -> None:
    # The COV of one run of 60 000 evaluations scatters by about 3 % here; 15 % is asked.
    errors = ExactErrors(reference_problem.records(1))
    laboratory = Laboratory(rng_seed)
    posterior = laboratory.run((1,), errors, CHOSEN, 60_000, added_rms=0.69e-3)
    assert (posterior.chains.rhat < 1.05).all()
    np.testing.assert_allclose(posterior.moments.cov[:3], TABLE_4['cov'][:3], rtol=0.15)
    narrow = laboratory.run((2,), errors, CHOSEN, 30_000)
    assert (narrow.moments.cov[:3] < 0.05 * TABLE_4['cov'][:3]).all()


def test_match_finds_the_residual_between_grid_points() -> None:
    added = np.array([0.2, 0.5, 0.9])
    cov = np.exp(np.array([[-1.0], [0.0], [1.0]])) * TABLE_4['cov']
    assert table_spread.match(added, cov, TABLE_4['cov']) == pytest.approx(0.5, abs=1e-3)
    assert table_spread.match(added, cov * np.exp(-0.5), TABLE_4['cov']) == pytest.approx(
        0.7, abs=1e-3
    )


def test_match_is_steady_against_the_scatter_of_short_runs(rng_seed: int) -> None:
    # COVs of slope 3 per mm with 5 % scatter at nine residuals: sd of the match below 0.02 mm.
    rng = np.random.default_rng(rng_seed)
    added = np.linspace(0.4, 0.9, 9)
    cov = TABLE_4['cov'] * np.exp(3 * (added - 0.69) + 0.05 * rng.standard_normal(9))[:, None]
    assert table_spread.match(added, cov, TABLE_4['cov']) == pytest.approx(0.69, abs=0.08)


class Entry(NamedTuple):
    """What the choice looks at in `shaping.Shaped`."""

    shaping_factor: float
    held_out: float
    converged: bool = True
    informative: bool = True


def test_choice_takes_the_usable_factor_that_covers_best() -> None:
    shaped = [
        Entry(8192.0, 0.3),
        Entry(512.0, 0.93),
        Entry(256.0, 0.97),
        Entry(128.0, 0.95, informative=False),
        Entry(64.0, 0.95, converged=False),
    ]
    choice = shaping.choose(shaped)
    assert choice.shaping_factor == 512.0  # as near as 256, and the narrower band
    assert choice.covers and choice.usable == 3 and choice.dropped == (128.0, 64.0)
    far = shaping.choose([Entry(8192.0, 0.1), Entry(64.0, 0.3)])
    assert far.shaping_factor == 64.0 and not far.covers
    none = shaping.choose([Entry(g, 0.95, converged=False) for g in (64.0, 128.0)])
    assert none.shaping_factor == 128.0 and none.usable == 0 and not none.covers


def test_shaping_factor_is_scored_on_samples_that_hold_the_residual(rng_seed: int) -> None:
    # A realisation of the residual scatters by sqrt(p q / 20000) < 0.0036 about its expectation;
    # 6 sd allowed.
    rng = np.random.default_rng(rng_seed)
    count, size = 20_000, 0.7e-3
    measured = 1e-3 * rng.standard_normal(count)
    lower, upper = measured - 0.3e-3, measured + 0.5e-3
    expected = shaping.expected_coverage(measured, lower, upper, size)
    noisy = measured + size * rng.standard_normal(count)
    assert expected == pytest.approx(np.mean((lower <= noisy) & (noisy <= upper)), abs=0.022)
    assert expected == pytest.approx(norm.cdf(0.5 / 0.7) - norm.cdf(-0.3 / 0.7))
    assert shaping.expected_coverage(measured, lower, upper, 0.0) == 1.0


def test_gelman_rubin_is_as_published(rng_seed: int) -> None:
    """Vrugt (2016), Eqs. 26 and 27, with T twice as many draws as are used."""
    draws = np.random.default_rng(rng_seed).standard_normal((400, 3, 5)).cumsum(axis=0)
    half = draws[200:]
    n = len(half)
    within = half.var(axis=0, ddof=1).mean(axis=0)
    between = n * half.mean(axis=0).var(axis=0, ddof=1)
    count, total = draws.shape[1], 2 * n
    target = (total - 2) / total * within + 2 / total * between
    ratio = (count + 1) / count * target / within
    expected = np.sqrt(ratio - (total - 2) / (count * total))
    assert np.allclose(gelman_rubin(draws), expected, rtol=1e-12)


def test_gelman_rubin_of_chains_that_are_apart_or_stuck(rng_seed: int) -> None:
    apart = np.random.default_rng(rng_seed).standard_normal((400, 4, 5))
    apart += np.arange(4)[:, None] * 5.0
    assert (gelman_rubin(apart) > 1.2).all()
    for nothing in (apart[:, :1], apart[:2], np.ones((100, 4, 1))):
        assert np.isnan(gelman_rubin(nothing)).all()


def test_evaluations_of_a_step_are_those_of_all_chains_and_the_start() -> None:
    chains = Chains(np.zeros((5, 3, 1)), np.zeros((5, 3)), 25, 10, 1)
    assert [evaluations_at(chains, step) for step in (0, 4)] == [13, 25]


def test_trace_says_when_r_hat_stays_below() -> None:
    rhat = np.array([[3.0, 1.1], [1.1, 1.1], [1.3, 1.0], [1.1, 1.1], [1.0, 1.0]])
    trace = shaping.ConvergenceTrace(np.arange(5) * 100.0, rhat)
    assert trace.converged_at() == 300.0
    assert shaping.ConvergenceTrace(trace.evaluations, rhat + 1).converged_at() == np.inf


def test_gain_with_the_specimen_removes_the_papers_residual() -> None:
    refits = misfit.study(reference_problem.records(1))
    before, after = refits['both'], refits['both, spring gain']
    assert refits['spring, gain'].gain == pytest.approx(1.051, abs=0.005)
    assert before.held_out[1] > 35e-6
    assert max(after.held_out.values()) < 20.6e-6  # the noise is 20 um
    assert misfit.removed(before.held_out[1], after.held_out[1]) > 0.95
    centres, rms = misfit.by_frequency(reference_problem.records(1)[1], before.residual[1])
    assert rms[centres < 1].min() > 2.5 * rms[centres > 9].max()


@pytest.mark.slow
def test_total_band_covers_what_it_says_and_the_glue_band_is_reported(rng_seed: int) -> None:
    """The 95 % total band covers 93-97 % of held-out samples over 12 simulated tests.

    Coverage of one case scatters by some 0.4 % (measured: 94.5 to 95.9 % over 20), their mean by
    0.12 %: outside 93-97 % by chance in fewer than 1 of 10^9 runs.
    """
    cases = [simulated_case(rng_seed + i) for i in range(12)]
    total = np.array([c.total for c in cases])
    assert 0.93 <= total.mean() <= 0.97
    assert np.mean((total >= 0.90) & (total <= 0.99)) >= 0.85
    # A parameter band is no predictive band: at G = 2^8 it covers a tenth, not 95 %.
    assert 0.0 < np.mean([c.glue for c in cases]) < 0.5


def test_numbers_are_written_for_people() -> None:
    assert num(1.26e9, 3) == '1.26 × 10⁹'
    assert num(-0.2, 2) == '−0.20'
    assert num(9.9996e5, 3) == '1.00 × 10⁶'
    assert num(0.0) == '0' and num(float('nan')) == '–' and num(float('inf')) == 'not reached'
    assert percent(-0.0372, 1, sign=True) == '−3.7\xa0%'
    assert power_of_two(8192.0) == '2¹³'
    assert listed([1.0, 5.0, 10.0]) == '1, 5 and 10' and listed(['a']) == 'a'
    assert listed([]) == 'none'


def test_eq_2a_is_eq_1_solved_at_every_frequency() -> None:
    """What the report's first row says of the model."""
    assert findings.model_difference() < 1e-12
