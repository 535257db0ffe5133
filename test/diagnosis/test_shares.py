"""Shares of names, their class of none, and the level of false alarms."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy import stats

from actuator_glue.diagnosis.score import false_alarms
from actuator_glue.diagnosis.score.scorer import Scorer, splits_of
from actuator_glue.diagnosis.search import ties
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.diagnosis.verdict import rules
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Array, Record


def trial(name: str, rms: float, scores: Array, size: int = 5) -> Trial:
    """A structure of which only name, error, scores and the number of parameters matter."""
    fit = SimpleNamespace(theta=np.zeros(size), z=np.zeros(size))
    found = SimpleNamespace(added=name, mean_square=rms**2, scores=scores, fit=fit)
    return cast('Trial', found)


def test_the_best_of_many_candidates_by_chance() -> None:
    """Evidence that independent candidates reach on noise: known in closed form."""
    n, period = 6000, 1e-2
    record = Record(np.zeros(n), np.zeros(n), period, stiffness=0.0)
    data = Data.whole([record])
    rng = np.random.default_rng(1)
    noise = 1e-5 * rng.standard_normal(n)
    scorer = Scorer.of(data, splits_of(data, noise))
    signatures, base = rng.standard_normal((40, n)), rng.standard_normal((4, n))
    found = [false_alarms.threshold(signatures, base, scorer, p) for p in (0.1, 0.01, 1e-4)]
    # Largest of 40 squared normal numbers: P(all below 2 nats) = (1 - p)
    for level, nats in zip((0.1, 0.01, 1e-4), found, strict=True):
        expected = 0.5 * stats.chi2.isf(-np.expm1(np.log1p(-level) / 40), 1)
        assert nats == pytest.approx(expected, rel=0.05)
    # Forty copies of one candidate are one candidate.
    same = np.repeat(signatures[:1], 40, axis=0)
    alone = false_alarms.threshold(same, base, scorer, 0.01)
    assert alone == pytest.approx(0.5 * stats.chi2.isf(0.01, 1), rel=0.05)


def test_held_out_records_that_contradict_lower_the_certainty() -> None:
    """Names that leave three times the noise where nothing was fitted are not certain."""
    error = HeldOutError(95e-6, (0, 1), 31e-6, (25e-6, 37e-6), 10e-6, 0.9, (0.8, 1.0), 95e-6)
    assert rules.certainty(0.95, True, error, 5e-6) == pytest.approx(0.9)
    # What one stretch of it shows alone is none of that, unless it is far above the noise.
    stretch = replace(error, after=13e-6, after_ci=(9e-6, 20e-6))
    assert rules.certainty(0.95, True, stretch, 5e-6) == 0.95
    assert rules.certainty(0.95, True, replace(error, after_ci=(9e-6, 50e-6)), 5e-6) == 0.9
    good = replace(error, after=11e-6, removable_removed=0.99)
    assert rules.certainty(0.95, True, good, 5e-6) == 0.95
    # A verdict that says the held-out part does not ask for the name gives it no probability.
    nothing = replace(
        error, before=10e-6, after=10e-6, removable_removed=0.0, removed_ci=(-0.5, 0.5)
    )
    assert rules.of_both_parts('missing-effect', True, nothing, 5e-6) == 'undecided'
    assert rules.certainty(0.95, True, nothing, 5e-6) == 0.0
    # Of what does not act in it, it says nothing.
    assert rules.of_both_parts('missing-effect', False, nothing, 5e-6) == 'missing-effect'
    assert rules.certainty(0.95, False, nothing, 5e-6) == 0.95


def test_held_out_records_may_show_little_of_what_matters() -> None:
    """All that they show, removed beyond chance, confirms a name; a part of it, or chance, not."""
    little = HeldOutError(
        10.3e-6, (9.8e-6, 10.8e-6), 10.0e-6, (9.5e-6, 10.5e-6), 10e-6, 1.0, (0.5, 2.5), 10.3e-6
    )
    assert rules.of_both_parts('missing-effect', True, little, 5e-6) == 'missing-effect'
    assert rules.certainty(0.95, True, little, 5e-6) == 0.95
    chance = replace(little, removed_ci=(-0.2, 2.5))
    assert rules.of_both_parts('missing-effect', True, chance, 5e-6) == 'undecided'
    part = replace(
        little, before=22.25e-6, after=22.2e-6, after_ci=(20e-6, 24e-6), removed_ci=(0.01, 0.1)
    )
    assert rules.of_both_parts('missing-effect', True, part, 5e-6) == 'undecided'


def test_shares_are_odds_that_sum_to_one() -> None:
    """Half as likely, a tenth, none of them; a pair has the names of both."""
    level, even = cast('Scorer', None), np.zeros(15)
    rest, best = trial('', 40e-6, np.full(15, -500.0)), trial('payload-inertia', 10e-6, even)
    two = trial('viscous-damping + delay', 10e-6, even - 1.0)
    one = trial('delay', 37e-6, even)
    found = ties.compare(rest, best, [one, two], (0.1, 0.5, 0.4), level)
    assert [r.name for r in found] == ['payload-inertia', 'viscous-damping + delay', 'delay']
    assert [r.probability for r in found] == pytest.approx([0.5, 0.25, 0.05])
    assert found[1].effects == ('viscous-damping', 'delay')
    assert found[1].nats == pytest.approx(14.0)
    # What removes less than half is no rival, however likely.
    assert [r.tied for r in found] == [True, True, False]


def test_what_has_next_to_no_weight_is_no_alternative() -> None:
    """Four nats behind."""
    level, even = cast('Scorer', None), np.zeros(15)
    rest, best = trial('', 40e-6, np.full(15, -500.0)), trial('delay', 10e-6, even)
    rivals = trial('sensor-lag', 10e-6, even), trial('valve-lag', 10e-6, even)
    odds = (np.exp(-3.9), np.exp(-4.1), 0.0)
    found = ties.compare(rest, best, rivals, odds, level)
    assert [r.tied for r in found] == [True, True, False]
