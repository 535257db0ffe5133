"""Structures side by side: weights by forecasts that were fixed before their data, mixtures."""

import itertools
import math
import pickle
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from live import fields, same
from online_streams import RATE, SETTINGS, THETA, stream

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.model.commands import noise
from actuator_glue.model.parameters import NAMES
from actuator_glue.model.structure import Structure
from actuator_glue.online import conversion
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.job import WindowResult, renew, run
from actuator_glue.online.knowledge import Known
from actuator_glue.online.playback import give, replay, sample_beside
from actuator_glue.online.replay_comparison import differences, published
from actuator_glue.online.schedule import Schedule
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


def lost_motion(seconds=10.0, seed=3):
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
            sample_beside(estimator)
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
        # One that has no posterior yet forecasts nothing.
        told = zip(result.structures, result.weights, result.parts, strict=True)
        weight = {name: share for name, share, part in told if part is not None}
        for part, share in zip(parts, shares, strict=True):
            wanted = weight[part.model.effects] / sum(weight.values())
            assert share == pytest.approx(wanted, abs=0.01)


def test_each_structure_tells_what_the_parameters_are_if_it_is_true(ran):
    result = next(r for r in ran[0] if len(r.structures) > 1 and None not in r.parts)
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
    (live,) = published(('EstimatorSetup', SimpleNamespace(**f)) for f in (first, later))
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


class Beside:
    """A live estimator of three structures whose others take some windows, as they are told.

    Args:
        takes: windows that pass until what is sampled beside has come, one after another.
        fails: windows that end without a posterior.
    """

    def __init__(self, takes, fails=(), seconds=7.0):
        self.results, self.began = [], []
        self.estimator = Estimator(SETTINGS, three(), live=True)
        self.done, coming = {}, None
        takes = itertools.cycle(takes)
        for item in stream(lost_motion(seconds)):
            give(self.estimator, item)
            while True:
                if coming is not None and coming[0] == 0:
                    self.estimator.finish_rival(pickle.loads(pickle.dumps(coming[1])))
                    coming = None
                if (job := self.estimator.next_job()) is None:
                    break
                result = run(pickle.loads(pickle.dumps(job)))
                if job.window.number in fails:
                    result = WindowResult(job.window, SETTINGS, job.model, failure='out of time')
                else:
                    self.results.append(result)
                    key = job.window.record.first_index, job.window.record.start_ns
                    self.done[key] = job.window.number, result.spent
                self.estimator.finish(result)
                if coming is not None:
                    coming = coming[0] - 1, coming[1]
                elif (rival := self.estimator.rival_job()) is not None:
                    self.began.append((rival.window.number, rival.model.effects))
                    coming = next(takes), renew(pickle.loads(pickle.dumps(rival)))

    def replayed(self):
        """What a replay of it gives."""
        schedule = Schedule(self.done, ((0, three()),))
        again = replay(stream(lost_motion(7.0)), SETTINGS, three(), schedule=schedule)
        return [r for r in again if isinstance(r, WindowResult)]


@pytest.fixture(scope='module')
def slow_beside():
    return Beside((2, 0, 3), fails=(4, 7))


@pytest.mark.slow
def test_no_window_of_the_likeliest_waits_for_the_others(slow_beside):
    """Its job holds nothing of them but what they forecast with."""
    first = slow_beside.results[0]
    assert first.structures[0] == ('backlash',) and first.spent[1:] == (0, 0)
    assert first.parts[1:] == (None, None) and first.frozen.beside == ()
    took = [any(r.spent[1:]) for r in slow_beside.results]
    assert any(took) and not all(took)
    assert all(r.spent[0] > 0 for r in slow_beside.results)


def test_who_has_waited_longest_is_sampled_beside_and_one_at_a_time(slow_beside):
    names = [name for _, name in slow_beside.began]
    assert names[:3] == [('coulomb-friction',), (), ('coulomb-friction',)]
    assert all(one != other for one, other in pairwise(names[:4]))
    # Of a window that was published: nothing may depend on the others.
    assert not {number for number, _ in slow_beside.began} & {4, 7}


def test_one_that_is_not_sampled_forecasts_with_its_last_posterior(slow_beside):
    """What has come is taken in once, and stands until the next."""
    changed, stood = 0, 0
    for before, after in pairwise(slow_beside.results):
        olds = {one.model: one for one in before.frozen.beside}
        spent = {one.model: one.evaluations for one in after.rivals}
        for new in after.frozen.beside:
            old = olds.get(new.model)
            assert new.start == after.frozen.start
            if spent[new.model]:
                changed += 1
                assert old is None or not np.array_equal(old.draws, new.draws)
            elif old is not None:
                stood += 1
                np.testing.assert_array_equal(old.draws, new.draws)
    assert changed >= 2 and stood >= 2


def test_a_replay_takes_in_what_came_from_beside_where_the_live_run_did(slow_beside):
    """To the last bit, though its own computer had it at once."""
    twice = slow_beside.replayed()
    assert len(twice) == len(slow_beside.results)
    assert all(same(*pair) for pair in zip(slow_beside.results, twice, strict=True))
    assert [r.spent for r in twice] == [r.spent for r in slow_beside.results]


def test_what_nobody_waits_for_any_more_is_let_go_of():
    estimator = Estimator(SETTINGS, three(), live=True)
    items = stream(lost_motion(4.0))

    def window():
        while (job := estimator.next_job()) is None:
            give(estimator, next(items))
        estimator.finish(run(job))

    window()
    old = estimator.rival_job()
    assert old is not None and estimator.rival_job() is None
    estimator.abandon_rival()  # its process has died
    assert estimator.rival_job() is old
    late = renew(old)
    estimator.set_model(choose_model(('backlash',)))
    window()
    estimator.finish_rival(late)
    window()
    assert [r for r, _ in estimator.weights] == [choose_model(('backlash',))]
    assert estimator.rival_job() is None


def weighing(*errors, settings=SETTINGS):
    """An estimator that carries play and Eq. (2), and the events of windows with such errors."""
    estimator = Estimator(settings, choose_model())
    window = None
    for item in stream(lost_motion(4.0)):
        give(estimator, item)
        while (job := estimator.next_job()) is not None:
            result = run(job)
            estimator.finish(result)
            window = result
    play, plain = Proposed(choose_model(('backlash',)), 0.98), Proposed(choose_model(), 0.02)
    estimator._begin(Proposal((play, plain), 5e-6))
    told = [estimator._members.weigh(replace(window, errors=pair)) for pair in errors]
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


def test_what_forecasts_have_not_excluded_stays_beside_what_is_proposed_next():
    """Looks at few data err; each of them knows nothing of those before."""

    def proposal(name, share):
        models = Proposed(choose_model((name,)), share), Proposed(choose_model(), 1.0 - share)
        return Proposal(models, 5e-6)

    estimator, _ = weighing()
    for name in ('coulomb-friction', 'delay'):
        estimator._begin(proposal(name, 0.98))
    shares = {model.effects: share for model, share in estimator.weights}
    assert set(shares) == {('delay',), (), ('coulomb-friction',), ('backlash',)}
    assert shares['coulomb-friction',] == pytest.approx(0.09 / 1.14, rel=0.02)
    assert shares['backlash',] == pytest.approx(0.05 / 1.14, rel=0.02)
    # Of those carried before as many as can be carried.
    for name in ('valve-deadband', 'gain'):
        estimator._begin(proposal(name, 0.98))
    names = [model.effects for model, _ in estimator.weights]
    assert names == [('gain',), (), ('valve-deadband',), ('delay',)]


def test_windows_in_quick_succession_leave_no_time_for_more_than_one_from_before():
    quick = replace(SETTINGS, hop=0.2, time_budget=0.2, window=4.0 + SETTINGS.settle)
    estimator, _ = weighing(settings=quick)
    for names in (('coulomb-friction', 'delay'), ('gain', 'valve-deadband')):
        new = [Proposed(choose_model((name,)), 0.4) for name in names]
        estimator._begin(Proposal((*new, Proposed(choose_model(), 0.2)), 5e-6))
    carried = [model.effects for model, _ in estimator.weights]
    assert carried == [('gain',), ('valve-deadband',), (), ('coulomb-friction',)]


def test_without_rivals_that_were_there_before_nothing_is_taken_out():
    """Who asks for one structure has it, whatever it forecasts."""
    estimator = Estimator(SETTINGS, Proposal((Proposed(choose_model(('backlash',))),)))
    assert not estimator._members._outdone((1.0,), 1e-9)


def test_what_was_found_on_one_actuator_is_not_carried_on_to_another():
    """Nor in a replay of the stream."""
    record = lost_motion(4.0)
    later = replace(record, start_ns=record.start_ns + 10**11, actuator='other')
    items = [*stream(replace(record, actuator='one')), *stream(later)]
    estimator, found, models = Estimator(SETTINGS, choose_model()), [], [(0, choose_model())]
    for item in items:
        give(estimator, item)
        while (job := estimator.next_job()) is not None:
            found.append(run(job))
            estimator.finish(found[-1])
            if job.proposal is not None:
                models.append((job.window.number, job.proposal))
            if job.window.number == 1:
                estimator.set_model(choose_model(('backlash',)))
    assert {(r.window.epoch, r.model.effects) for r in found[2:]} == {
        (1, ('backlash',)),
        (2, ()),
    }
    assert [model.structures[0].model.effects for _, model in models[1:]] == [('backlash',), ()]
    done = {
        (r.window.record.first_index, r.window.record.start_ns): (r.window.number, r.spent)
        for r in found
    }
    again = replay(items, SETTINGS, schedule=Schedule(done, tuple(models)))
    twice = [r for r in again if isinstance(r, WindowResult)]
    for one, other in zip(found, twice, strict=True):
        assert np.array_equal(one.moments.mean, other.moments.mean)


@pytest.mark.parametrize('afresh', [False, True])
def test_a_structure_that_begins_afresh_forgets_what_it_learned(afresh):
    """What it learned may be what no window can be estimated with; a replay forgets it, too."""
    settings = replace(SETTINGS, prior='sequential', drift=0.0)
    proposal = Proposal((Proposed(choose_model()),), afresh=afresh)
    estimator, found, priors = Estimator(settings, choose_model()), [], {}
    items = list(stream(lost_motion(10.0)))
    for item in items:
        give(estimator, item)
        while (job := estimator.next_job()) is not None:
            number = job.window.number
            priors[number] = job.prior
            found.append(run(job))
            estimator.finish(found[-1])
            if number == 8:
                estimator.set_model(proposal)
    assert priors[8] is not None and (priors[9] is None) is afresh
    assert priors[max(priors)] is not None
    # As a bag has it.
    told = conversion.estimator_setup(settings, proposal, 9, 0)
    read = Proposal.of(conversion.proposal(SimpleNamespace(**told)))
    assert read.afresh is afresh
    done = {
        (r.window.record.first_index, r.window.record.start_ns): (r.window.number, r.spent)
        for r in found
    }
    models = ((0, choose_model()), (9, read))
    again = replay(items, settings, schedule=Schedule(done, models))
    twice = [r for r in again if isinstance(r, WindowResult)]
    assert len(twice) == len(found)
    for one, other in zip(found, twice, strict=True):
        assert np.array_equal(one.moments.mean, other.moments.mean)
