"""Structures side by side: weights by forecasts that were fixed before their data, mixtures."""

import math
import pickle
from dataclasses import replace
from functools import partial
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from live import fields
from online_streams import RATE, SETTINGS, THETA, stream

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.model.commands import noise
from actuator_glue.model.parameters import NAMES
from actuator_glue.model.structure import Structure
from actuator_glue.online import conversion
from actuator_glue.online.estimator import Estimator, Schedule
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.knowledge import Known
from actuator_glue.online.playback import give, replay
from actuator_glue.online.replay_comparison import differences, published
from actuator_glue.online.stream import Reweighed
from actuator_glue.online.structures import Proposal, Proposed, moved, pooled, weights
from actuator_glue.records import Record


def test_an_error_of_what_matters_costs_four_nats_once_and_forgotten_forecasts_none():
    evidence = np.zeros(2)
    for _ in range(200):
        evidence = moved(evidence, (1e-10, 1e-10 + 25e-12), 5e-6, 1.0, 10.0)
    assert evidence == pytest.approx([0.0, -4.0], abs=1e-6)
    # However many forecasts: a tenth of what matters decides nothing.
    for _ in range(200):
        evidence = moved(evidence, (1e-10, 1e-10 + 0.25e-12), 5e-6, 1.0, 10.0)
    assert weights(np.log([0.5, 0.5]), evidence) == pytest.approx([0.51, 0.49], abs=1e-3)
    # One forecast after a time of memory counts 1 - 1/e.
    once = moved(np.zeros(2), (0.0, 25e-12), 5e-6, 10.0, 10.0)
    assert once[1] == pytest.approx(-4.0 * (1.0 - math.exp(-1.0)))


def test_a_structure_without_a_forecast_moves_no_weight():
    before = np.array([0.0, -1.0])
    assert moved(before, (1e-10, math.nan), 5e-6, 1.0, 10.0) is before
    assert moved(before, (), 5e-6, 1.0, 10.0) is before


def test_pooled_draws_are_those_of_the_mixture():
    rng = np.random.default_rng(1)
    ours = np.column_stack([rng.normal(0.0, 1.0, 4000), rng.normal(5.0, 0.1, 4000)])
    theirs = rng.normal(10.0, 1.0, (500, 1))
    both = pooled(('a', 'b'), [(0.75, ('a', 'b'), ours), (0.25, ('a',), theirs)], rng)
    # Of 4000 draws: four standard errors.
    assert (both[:, 0] > 5.0).mean() == pytest.approx(0.25, abs=0.03)
    assert both[:, 1].mean() == pytest.approx(5.0, abs=0.01)
    assert pooled(('a', 'b'), [(1.0, ('a', 'b'), ours)], rng) is ours


@pytest.mark.parametrize(
    ('structures', 'said'),
    [
        ((), '0 structures'),
        ((Proposed(choose_model()),) * 4, '4 structures'),
        ((Proposed(choose_model()), Proposed(choose_model())), 'twice'),
        ((Proposed(choose_model(), 0.0),), 'not positive'),
        ((Proposed(choose_model(), math.nan),), 'not positive'),
    ],
)
def test_what_cannot_be_carried_is_refused(structures, said):
    with pytest.raises(InputError, match=said):
        Proposal(structures)


def test_knowledge_outside_the_bounds_is_refused():
    draws = np.tile([134.0, 1.1e9, 2.5e5, 900.0], (60, 1)) * np.linspace(0.99, 1.01, 60)[:, None]
    with pytest.raises(InputError, match='alpha_3'):
        Proposal((Proposed(choose_model(), 1.0, Known(Carried(NAMES, draws), 0, 0)),))


SIZE = 6e-5


def lost_motion(seconds=14.0, seed=3):
    """A stream with play of 60 um beyond 10 um of noise."""
    command = noise(RATE, seconds, 0.2, 8.0, seed=seed)
    clean = Structure(('backlash',))
    record = Record(command, command, 1.0 / RATE, 250e3, start_ns=10**18)
    measured = clean.simulate(np.array([*THETA, SIZE]), record)
    measured = measured + 1e-5 * np.random.default_rng(seed).standard_normal(len(command))
    return Record(command, measured, 1.0 / RATE, 250e3, start_ns=10**18)


def both(known=None):
    return Proposal(
        (
            Proposed(choose_model(), 0.9),
            Proposed(choose_model(('backlash',), start={'backlash': SIZE}), 0.1, known),
        )
    )


def carried_side_by_side(items, at=2):
    """Results and events of a run in which two structures are carried from a window on."""
    estimator = Estimator(SETTINGS, choose_model())
    found, events, models = [], [], [(0, estimator.proposal)]
    for item in items:
        events += give(estimator, item)
        while (job := estimator.next_job()) is not None:
            result = run(pickle.loads(pickle.dumps(job)))
            events += estimator.finish(pickle.loads(pickle.dumps(result)))
            found.append(result)
            if job.proposal is not None:
                models.append((job.window.number, job.proposal))
            if job.window.number == at:
                estimator.set_model(both())
    return found, events, models, estimator


@pytest.fixture(scope='module')
def ran():
    return carried_side_by_side(stream(lost_motion()))


def test_the_structure_whose_forecasts_are_right_takes_over_and_the_other_leaves(ran):
    found, events, _, estimator = ran
    told = [event for event in events if isinstance(event, Reweighed)]
    first = next(r for r in found if len(r.structures) > 1)
    assert first.structures == ((), ('backlash',)) and first.weights == pytest.approx((0.9, 0.1))
    assert told[0].weights[0][0] == ('backlash',)
    assert told[-1].left == ((),) and 'no longer carried: Eq. (2)' in told[-1].message
    assert [model.effects for model, _ in estimator.weights] == [('backlash',)]
    assert found[-1].structures == (('backlash',),) and found[-1].weights == (1.0,)


def test_bands_are_those_of_the_mixture_and_scored_as_they_were_frozen(ran):
    found, _, _, _ = ran
    for result in found:
        parts = result.frozen.parts
        shares = [len(part.draws) / SETTINGS.draws for part in parts]
        assert sum(shares) == pytest.approx(1.0, abs=0.01)
        for part, share in zip(parts, shares, strict=True):
            weight = dict(zip(result.structures, result.weights, strict=True))
            assert share == pytest.approx(weight[part.model.effects], abs=0.01)


def test_each_structure_tells_what_the_parameters_are_if_it_is_true(ran):
    result = next(r for r in ran[0] if len(r.structures) > 1)
    told = conversion.posterior(result, 0.0)[1]
    assert told['structures'] == ['Eq. (2)', 'backlash'] and told['structure_sizes'] == [4, 5]
    assert told['structure_parameter_names'] == [*NAMES, *NAMES, 'backlash']
    assert told['structure_units'][-1] == 'm'
    plain, play = (part[1] for part in result.parts)
    assert abs(play.mean[-1] - SIZE) < 4.0 * play.stddev[-1] < 1e-5
    # What Eq. (2) alone makes of lost motion is another lag.
    assert abs(plain.mean[0] - play.mean[0]) > 3.0 * np.hypot(plain.stddev[0], play.stddev[0])
    # What is published above them is their mixture: a tenth of 400 draws is 30 to 50.
    mixed = 0.9 * plain.mean[0] + 0.1 * play.mean[0]
    assert told['mean'][0] == pytest.approx(mixed, rel=0.02)
    alone = next(r for r in ran[0] if len(r.structures) == 1)
    np.testing.assert_array_equal(alone.parts[0][1].mean, alone.moments.mean)


def test_a_replay_repeats_weights_and_mixtures_to_the_last_bit(ran):
    found, _, models, _ = ran
    done = {
        (r.window.record.first_index, r.window.record.start_ns): (r.window.number, r.spent)
        for r in found
    }
    again = replay(stream(lost_motion()), SETTINGS, schedule=Schedule(done, tuple(models)))
    twice = [r for r in again if isinstance(r, WindowResult)]
    assert len(twice) == len(found) > 10

    class Message:
        def __init__(self, given):
            self.__dict__.update(given)

    for one, other in zip(found, twice, strict=True):
        pairs = zip(fields(one), fields(other), strict=True)
        assert [name for a, b in pairs for name in differences(a, Message(b))] == []


def test_a_proposal_survives_its_way_through_a_bag_to_the_last_bit():
    rng = np.random.default_rng(2)
    draws = np.array([*THETA, SIZE]) * np.exp(0.01 * rng.standard_normal((80, 5)))
    known = Known(Carried((*NAMES, 'backlash'), draws), 10**18 + 1, 10**18 + 7)
    proposal = both(known)
    again = Proposal.from_json(proposal.to_json())
    assert again == proposal and math.isnan(again.material)
    assert again.structures[1].known.carried.draws.tobytes() == draws.tobytes()
    assert again.structures[1].model.start[4] == SIZE
    with pytest.raises(InputError, match='cannot be read'):
        Proposal.from_json({'carried': [{}]}, 'a bag')


def test_a_bag_tells_what_was_carried_from_which_window_on():
    rng = np.random.default_rng(2)
    draws = np.array([*THETA, SIZE]) * np.exp(0.01 * rng.standard_normal((80, 5)))
    proposal = both(Known(Carried((*NAMES, 'backlash'), draws), 10**18 + 1, 10**18 + 7))
    first = conversion.estimator_setup(SETTINGS, choose_model(), 0, 0)
    later = conversion.estimator_setup(SETTINGS, proposal, 9, 1800)
    live = published(('EstimatorSetup', SimpleNamespace(**f)) for f in (first, later))
    assert live.settings == SETTINGS
    assert live.models == [(0, choose_model()), (9, proposal)]


def test_a_gain_that_drifts_is_what_a_later_record_has_of_it():
    """The catalogue counts from the beginning of each record."""
    lacking = Structure(('gain-drift',))
    command = noise(RATE, 12.0, 0.2, 8.0, seed=2)
    whole = Record(command, command, 1.0 / RATE, 250e3)
    theta = np.array([*THETA, 0.02])
    first = lacking.simulate(theta, whole)
    draws = np.tile(theta, (60, 1))
    after = Carried((*NAMES, 'gain_drift'), draws).later(5.0)
    cut = replace(whole, measured=first).slice(round(5.0 * RATE), len(command))
    again = lacking.simulate(after.draws[0], cut, initial='measured')
    settled = slice(round(2.0 * RATE), None)
    # The initial state is measured: its transient is not quite gone.
    assert np.abs(again - cut.measured)[settled].max() < 1e-7
    assert np.abs(lacking.simulate(theta, cut, initial='measured') - cut.measured).max() > 1e-5
    plain = Carried(NAMES, draws[:, :4])
    assert plain.later(5.0) is plain


def test_handed_sizes_are_the_prior_of_windows_that_they_have_not_seen():
    """Half a percent of play: far less than a window of 2 s tells by itself."""
    rng = np.random.default_rng(4)
    draws = np.array([*THETA, SIZE]) * np.exp(0.002 * rng.standard_normal((400, 5)))
    record = lost_motion(8.0)
    last = record.stamp_ns(round(5.0 * RATE))
    known = Known(Carried((*NAMES, 'backlash'), draws), last, last)
    settings = replace(SETTINGS, prior='sequential', drift=0.0)
    estimator = Estimator(settings, choose_model())
    model = choose_model(('backlash',), start={'backlash': SIZE})
    estimator.set_model(Proposal((Proposed(model, 1.0, known),)))
    spread = {}
    for item in stream(record):
        give(estimator, item)
        while (job := estimator.next_job()) is not None:
            result = run(job)
            estimator.finish(result)
            counted = job.window.record.stamp_ns(round(SETTINGS.settle * RATE))
            spread.setdefault(counted > last, []).append(result.moments.stddev[4] / SIZE)
    assert min(spread[False]) > 0.004 and max(spread[True]) < 0.0025


def three():
    """Two structures with effects beside Eq. (2)."""
    return Proposal(
        (
            Proposed(choose_model(('backlash',), start={'backlash': SIZE}), 0.6),
            Proposed(choose_model(('coulomb-friction',)), 0.3),
            Proposed(choose_model(), 0.1),
        )
    )


def hurried(seconds=6.0, budget=200):
    """Results of a run whose clock counts steps: the likeliest takes more than half of them."""
    estimator, found = Estimator(SETTINGS, three()), []
    for item in stream(lost_motion(seconds)):
        give(estimator, item)
        while (job := estimator.next_job()) is not None:
            steps, whole = iter(range(10**9)), budget / job.usual
            spent = partial(lambda steps, whole, share: next(steps) > share * whole, steps, whole)
            found.append(run(job, spent))
            assert not found[-1].failure
            estimator.finish(found[-1])
    return found


@pytest.fixture(scope='module')
def short_of_time():
    return hurried()


def test_who_has_waited_three_windows_has_half_of_the_time(short_of_time):
    friction = [
        r.spent[i]
        for r in short_of_time
        for i, names in enumerate(r.structures)
        if names == ('coulomb-friction',)
    ]
    # The first window is the fourth that it waited for: it had none before.
    assert len(friction) >= 4 and friction[:3] == [0, 0, 0] and friction[3] > 0


def test_a_structure_without_time_forecasts_with_its_last_posterior(short_of_time):
    pairs = [
        (before, after)
        for before, after in pairwise(short_of_time)
        if len(after.rivals) == 2 and after.rivals[0].archive is None
    ]
    kept = [(a, b) for a, b in pairs if a.rivals[0].frozen is not None]
    for before, after in kept:
        old, new = before.rivals[0].frozen, after.rivals[0].frozen
        np.testing.assert_array_equal(old.draws, new.draws)
        assert new.start == after.frozen.start and new in after.frozen.beside
        assert after.parts[1] is not None
    assert kept


def weighing(*errors):
    """An estimator that carries play and Eq. (2), and the events of windows with such errors."""
    estimator = Estimator(SETTINGS, choose_model())
    window = None
    for item in stream(lost_motion(4.0)):
        give(estimator, item)
        while (job := estimator.next_job()) is not None:
            result = run(job)
            estimator.finish(result)
            window = result
    play, plain = Proposed(choose_model(('backlash',)), 0.98), Proposed(choose_model(), 0.02)
    estimator._begin(Proposal((play, plain), 5e-6))
    told = [estimator._weigh(replace(window, errors=pair)) for pair in errors]
    return estimator, told


GOOD, BAD = 1e-10, 1e-10 + 30e-12  # a little more than what matters


def test_an_addition_that_makes_forecasts_worse_is_out_within_three_windows():
    estimator, told = weighing(*[(BAD, GOOD)] * 3)
    assert told[0] == told[1] == []
    assert told[2][0].worse and told[2][0].left == (('backlash',),)
    assert 'backlash made them worse' in told[2][0].message
    assert [(model.effects, share) for model, share in estimator.weights] == [((), 1.0)]


def test_one_window_that_is_no_worse_begins_the_count_anew():
    _, told = weighing(*[(BAD, GOOD), (BAD, GOOD), (GOOD, GOOD), (BAD, GOOD), (BAD, GOOD)])
    assert told == [[]] * 5


def test_what_forecasts_have_excluded_comes_back_where_the_addition_makes_them_worse():
    estimator, told = weighing(*[(GOOD, 50.0 * GOOD)] * 3, *[(BAD, GOOD)] * 3)
    assert told[0][0].left == ((),) and not told[0][0].worse
    assert estimator.weights[0][0].effects == () and told[-1][0].worse


def test_without_rivals_that_were_there_before_nothing_is_taken_out():
    """Who asks for one structure has it, whatever it forecasts."""
    estimator = Estimator(SETTINGS, Proposal((Proposed(choose_model(('backlash',))),)))
    assert not estimator._outdone((1.0,), 1e-9)
