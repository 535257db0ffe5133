"""Rankings: weights from block scores, their class of none, and the level of false alarms."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy import stats

from actuator_glue.diagnosis import false_alarms, ranking, verdict
from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.held_out import HeldOutError
from actuator_glue.diagnosis.ranking import standard_error, weights
from actuator_glue.diagnosis.score import Scorer, splits_of
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Array, Record


def trial(name: str, rms: float, scores: Array, size: int = 5) -> Trial:
    """A structure of which only name, error, scores and the number of parameters matter."""
    fit = SimpleNamespace(theta=np.zeros(size), z=np.zeros(size))
    found = SimpleNamespace(added=name, mean_square=rms**2, scores=scores, fit=fit)
    return cast('Trial', found)


def test_a_rival_within_its_standard_error_keeps_a_probability() -> None:
    """Two standard errors of 100 nats behind is not excluded, whatever the nats are.

    (Normal: a deficit of 1.9 standard errors is made up in 2.9 % of samples of blocks; the seed
    of the draws is fixed, so this fails never or always.)
    """
    rng = np.random.default_rng(0)
    difference = rng.standard_normal(50)
    difference += 1.9 / np.sqrt(50) * difference.std(ddof=1) - difference.mean()
    difference *= 30.0
    assert difference.sum() > 250.0
    assert difference.sum() / standard_error(difference) == pytest.approx(1.9)
    best, rival = weights(np.stack([difference, 0.0 * difference]))
    assert best + rival == pytest.approx(1.0)
    assert 0.005 < rival < 0.08


def test_equal_gains_in_all_blocks_are_certain() -> None:
    """Where every block says the same the exponential of the nats decides."""
    best, rival = weights(np.stack([np.full(40, 0.1), np.zeros(40)]))
    assert rival / best == pytest.approx(np.exp(-4.0), rel=1e-6)


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


def test_names_that_are_tied_by_size_share_the_probability() -> None:
    """What is told as 'cannot be told apart' is not told as certain: 80 nats, 1 % of the error."""
    known = ranking._tolerant(np.array([1.0, 1e-30, 0.0]), [1e-8], 1e-6)
    assert known == pytest.approx([0.5, 0.5, 0.0], abs=1e-3)
    apart = ranking._tolerant(np.array([1.0, 1e-30, 0.0]), [3e-6], 1e-6)
    assert apart == pytest.approx([1.0, 0.0, 0.0])


def test_an_alternative_has_a_probability() -> None:
    """A rival that every block excludes is none, however unevenly the blocks do.

    Two blocks hold nearly all the evidence, so that its standard error is near its sum.
    """
    against = np.full(15, 400.0)
    against[:2] = 45e3
    rest = trial('', 40e-6, np.full(15, -10e3) - against)
    best = trial('backlash', 5e-6, np.zeros(15))
    far = trial('specimen-hardening', 32e-6, -against)
    alike = trial('coulomb-friction', 5.2e-6, np.full(15, -20.0))
    level = cast('Scorer', None)  # none of these is a richer form of another
    found = ranking.compare(rest, best, [far, alike], level, Thresholds())
    told = {r.name: r for r in found}
    assert told['specimen-hardening'].nats < 2.0 * told['specimen-hardening'].stderr
    assert not told['specimen-hardening'].tied
    assert told['specimen-hardening'].probability < 1e-6
    assert told['coulomb-friction'].tied
    assert told['coulomb-friction'].weight > 0.4
    assert 0.1 < told['coulomb-friction'].probability < 0.2


def test_a_rival_that_only_shares_is_told_by_how_often_such_are_right(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Excluded by the blocks, or a richer form that gains nothing: a quarter of the odds.

    Who speaks for what is tied is still decided by equal shares.
    """
    even = np.zeros(15)
    rest, best = trial('', 40e-6, np.full(15, -500.0)), trial('coulomb-friction', 10e-6, even)
    level = cast('Scorer', None)
    behind = trial('specimen-yield', 10e-6, np.full(15, -2.0))
    richer = trial('stribeck-friction', 10e-6, even, 6)
    ahead = trial('stribeck-friction', 10e-6, np.full(15, 0.01), 6)
    for other, limit, share in (
        (behind, None, 0.25),
        (richer, ('slope', 0.1), 0.25),
        (ahead, ('slope', 0.1), 1.0),
    ):
        monkeypatch.setattr(ranking, '_limit', lambda t, name, scorer, limit=limit: limit)
        told = ranking.compare(rest, best, [other], level, Thresholds())
        first, second = (next(r for r in told if r.name == t.added) for t in (best, other))
        assert second.probability / first.probability == pytest.approx(share, rel=0.2)
        assert second.weight / first.weight == pytest.approx(1.0, rel=0.2)
        assert second.tied


def test_one_stretch_alone_excludes_no_rival() -> None:
    """A hundred nats of one block and next to nothing of the others: both names are possible."""
    level, even = cast('Scorer', None), np.zeros(15)
    rest, best = trial('', 40e-6, np.full(15, -500.0)), trial('delay', 10e-6, even)
    against = np.full(15, 0.1)
    for blocks, least, most in ((1, 0.1, 0.3), (2, 0.0, 0.01)):
        against[:blocks] = 100.0
        lag = trial('sensor-lag', 14e-6, -against)
        found = ranking.compare(rest, best, [lag], level, Thresholds())
        told = {r.name: r for r in found}['sensor-lag']
        assert told.nats == pytest.approx(against.sum() - 100.0)
        assert told.tied is (blocks == 1) and least <= told.probability <= most


def test_one_stretch_alone_puts_nothing_richer_ahead() -> None:
    """A hundred nats of one block for more parameters: both names are as likely without it."""
    level, even = cast('Scorer', None), np.zeros(15)
    rest, best = trial('', 40e-6, np.full(15, -500.0)), trial('viscous-damping', 10e-6, even)
    once = np.where(np.arange(15) == 3, 100.0, 0.0)
    for size, share in ((6, 0.5), (5, 0.0)):
        payload = trial('payload-inertia', 4e-6, once, size)
        found = ranking.compare(rest, best, [payload], level, Thresholds())
        told = {r.name: r.probability for r in found}
        assert told['viscous-damping'] == pytest.approx(share, abs=0.2)


def test_a_richer_form_at_its_bound_takes_no_weight_of_the_name_that_it_mends() -> None:
    """Ten nats in each block ahead: half of the weight that both have stays the name's."""
    level, even = cast('Scorer', None), np.zeros(15)
    rest, best = trial('', 40e-6, np.full(15, -500.0)), trial('coulomb-friction', 10e-6, even)
    form = trial('delay', 4e-6, np.full(15, 10.0), 6)
    for pressed, share in ((False, 0.0), (True, 0.5)):
        found = ranking.compare(rest, best, [form], level, Thresholds(), pressed=[pressed])
        told = {r.name: r.probability for r in found}
        assert told['coulomb-friction'] == pytest.approx(share, abs=1e-6)
        assert sum(told.values()) == pytest.approx(1.0)


def test_held_out_records_that_contradict_lower_the_certainty() -> None:
    """Names that leave three times the noise where nothing was fitted are not certain."""
    error = HeldOutError(95e-6, (0, 1), 31e-6, (25e-6, 37e-6), 10e-6, 0.9, (0.8, 1.0), 95e-6)
    assert verdict.certainty(0.95, error, 5e-6) == pytest.approx(0.9)
    # What one stretch of it shows alone is none of that, unless it is far above the noise.
    stretch = replace(error, after=13e-6, after_ci=(9e-6, 20e-6))
    assert verdict.certainty(0.95, stretch, 5e-6) == 0.95
    assert verdict.certainty(0.95, replace(error, after_ci=(9e-6, 50e-6)), 5e-6) == 0.9
    good = replace(error, after=11e-6, removable_removed=0.99)
    assert verdict.certainty(0.95, good, 5e-6) == 0.95
    # A verdict that says the held-out part does not ask for the name gives it no probability.
    nothing = replace(error, before=10e-6, after=10e-6, removable_removed=0.0)
    assert verdict.conclude('missing-effect', True, nothing, 5e-6) == 'undecided'
    assert verdict.certainty(0.95, nothing, 5e-6) == 0.0


def test_three_of_a_kind_speak_for_what_is_tied() -> None:
    """Damping ahead by a hair of three lags is told as a lag; ahead of one, as damping."""
    groups = dict.fromkeys(('delay', 'sensor-lag', 'valve-lag'), 'lag') | {'damping': 'damping'}
    names = ('damping', 'valve-lag', 'delay', 'sensor-lag')
    shares = (0.35, 0.25, 0.2, 0.1)
    rows = [Rival(n, 0.0, 0.0, 0.0, True, p, p) for n, p in zip(names, shares, strict=True)]
    assert ranking.spokesman('damping', rows, groups) == 'valve-lag'
    assert ranking.spokesman('damping', rows[:2], groups) == 'damping'
    apart = [rows[0], *(replace(r, tied=False) for r in rows[1:])]
    assert ranking.spokesman('damping', apart, groups) == 'damping'


def test_a_pair_pays_for_being_one_of_many() -> None:
    """As good by blocks and error, one of ten pairs to an effect has a tenth of its weight."""
    level, even = cast('Scorer', None), np.zeros(15)
    rest, best = trial('', 40e-6, np.full(15, -500.0)), trial('payload-inertia', 10e-6, even)
    pair = trial('viscous-damping + delay', 10e-6, even)
    found = ranking.compare(rest, best, [pair], level, Thresholds(), float(np.log(10.0)))
    told = {r.name: r for r in found}
    assert told['payload-inertia'].probability == pytest.approx(10 / 11, rel=1e-3)
    assert told['viscous-damping + delay'].probability == pytest.approx(1 / 11, rel=1e-3)
    assert told['viscous-damping + delay'].effects == ('viscous-damping', 'delay')
    assert told['viscous-damping + delay'].tied


@pytest.mark.parametrize('other', ['viscous-damping + delay', 'delay'])
def test_what_is_behind_keeps_its_share_where_their_errors_are_alike(other: str) -> None:
    """300 nats behind what does not speak: half the weight at the same error, or none."""
    level, ahead = cast('Scorer', None), np.full(15, 20.0)
    rest, best = trial('', 40e-6, np.full(15, -500.0)), trial('payload-inertia', 10e-6, 0 * ahead)
    for rms, low, high in ((9.99e-6, 0.45, 0.5), (4e-6, 0.0, 1e-6)):
        pair = trial(other, rms, ahead)
        found = ranking.compare(rest, best, [pair], level, Thresholds(), float(np.log(10.0)))
        told = {r.name: r.probability for r in found}
        assert low <= told['payload-inertia'] <= high
        assert told[other] == pytest.approx(1 - told['payload-inertia'])
