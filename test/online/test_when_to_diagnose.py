"""When a stream is diagnosed and what follows, as a pure state machine."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from actuator_glue.api.live import concluded, proposed
from actuator_glue.inference.choice import choose_model
from actuator_glue.model.parameters import NAMES
from actuator_glue.model.structure import Structure
from actuator_glue.online import when_to_diagnose as live
from actuator_glue.online.structures import Proposal, Proposed
from actuator_glue.records import Record

SETTINGS = live.LiveSettings(apply=True, coverage_windows=3, minimum=20.0, pause=10.0)
PLAY = frozenset({'backlash'})


def proposal(*effects):
    return Proposal.of(choose_model(effects))


def run(state, *inputs):
    """The last state and all actions."""
    actions = []
    for given in inputs:
        state, told = live.step(state, given)
        actions += told
    return state, actions


def looks(actions):
    return [action.reason for action in actions if isinstance(action, live.Look)]


def carries(actions):
    return [a.proposal.structures[0].model.effects for a in actions if isinstance(a, live.Carry)]


def broken(seconds=30.0):
    """A loop whose first diagnosis runs, because coverage broke."""
    state, actions = run(live.init(SETTINGS), live.Received(seconds), *[live.Judged(0.5)] * 3)
    assert len(looks(actions)) == 1 and state.diagnosing == 'the stream'
    return state


def test_a_break_is_told_once_and_diagnosed_as_soon_as_there_are_enough_data():
    state, actions = run(live.init(SETTINGS), live.Received(12.0), *[live.Judged(0.6)] * 6)
    assert looks(actions) == [] and [a.kind for a in actions] == ['coverage']
    state, actions = run(state, live.Received(19.9), live.Received(20.0), live.Received(20.5))
    assert looks(actions) == [
        'the band of parameters and sensor noise covers 60% of '
        'the samples: the model lacks something'
    ]


def test_a_break_is_told_once_and_armed_again():
    state, told = live.init(SETTINGS), []
    for coverage in (0.9, 0.9, 0.95, 0.7, 0.7, 0.5, 0.4, 0.95, 0.95, 0.95, 0.1):
        state, actions = run(state, live.Judged(coverage))
        told.append(bool(actions))
    assert told == [False] * 4 + [True] + [False] * 5 + [True]
    assert math.isnan(run(state, live.Began())[0].coverage)


def test_healthy_bands_start_nothing():
    state, actions = run(
        live.init(SETTINGS),
        *[x for i in range(500) for x in (live.Judged(0.94), live.Received(i))],
    )
    assert actions == [] and state.trusted


def test_it_looks_again_at_twice_the_data_while_something_is_open():
    state, actions = run(broken(20.0), live.Concluded(proposal('backlash'), left_open=True))
    assert carries(actions) == [('backlash',)]
    asked = []
    for seconds in range(21, 200):
        state, actions = run(state, live.Received(float(seconds)))
        if looks(actions):
            asked.append(seconds)
            state, _ = run(state, live.Concluded(proposal('backlash'), left_open=True))
    assert asked == [40, 80, 160]
    settled = live.Concluded(proposal('backlash'))
    state, actions = run(state, live.Requested(), settled, live.Received(1e4))
    assert looks(actions) == []


def test_what_was_added_is_looked_at_again_in_twice_the_data():
    """A gain that drifts is small at first, and windows follow it: no alarm would tell."""
    state, _ = run(broken(20.0), live.Concluded(proposal('backlash')))
    carried = live.Estimated(False, ((PLAY, 0.99), (frozenset(), 0.01)))
    state, actions = run(state, carried, live.Received(39.9))
    assert looks(actions) == []
    state, actions = run(state, live.Received(40.0))
    assert looks(actions) == ['there are twice as many data as what was added was found in']
    state, actions = run(state, live.Concluded(proposal('backlash', 'gain-drift')))
    assert carries(actions) == [('backlash', 'gain-drift')]


@pytest.mark.parametrize('apply', [None, True])
def test_what_was_found_of_an_actuator_is_carried_for_no_other(apply):
    state, _ = run(broken(60.0), live.Received(0.5))
    found = live.Concluded(proposal('backlash'), left_open=True, apply=apply)
    state, actions = run(state, found)
    assert [action.kind for action in actions] == ['diagnosis']
    # Nor do names that are tied there have this one looked at.
    state, actions = run(state, live.Received(500.0))
    assert actions == []
    # What was found of this one is carried.
    _, actions = run(state, live.Requested(), found)
    assert carries(actions) == [('backlash',)]


def test_other_records_and_what_is_given_up_say_nothing_of_the_stream():
    state, _ = run(broken(20.0), live.Concluded(proposal('backlash'), left_open=True))
    others = live.Requested(streamed=False)
    own_setting = live.Concluded(None, 'it has a setting of its own')
    for begin, end in ((others, own_setting), (live.Requested(), live.GivenUp())):
        _, actions = run(state, begin, end, live.Received(40.0))
        assert looks(actions)[0].startswith('names are tied')
    # An alarm that was raised meanwhile is looked into for its own reason.
    quiet, _ = run(live.init(SETTINGS), live.Received(30.0), live.Judged(0.9))
    for end in (live.Concluded(proposal(), left_open=True), live.GivenUp()):
        _, actions = run(quiet, others, *[live.Judged(0.1)] * 5, end, live.Received(40.0))
        assert [reason.partition(' covers')[0] for reason in looks(actions)] == [
            'the band of parameters and sensor noise'
        ]
    # And a diagnosis of them is carried where that was asked for.
    assert carries(run(quiet, others, live.Concluded(proposal('backlash'), apply=True))[1])


def test_a_look_without_records_waits_for_more_data():
    """Without a pause, gaps had it look for ever at the same moment."""
    settings = replace(SETTINGS, pause=0.0)
    state, actions = run(live.init(settings), live.Received(30.0), *[live.Judged(0.5)] * 3)
    assert len(looks(actions)) == 1
    state, actions = run(state, live.GivenUp(), live.Received(30.0))
    assert looks(actions) == []
    assert len(looks(run(state, live.Received(30.5))[1])) == 1


def test_a_contradicted_prior_is_looked_into_and_once():
    state, _ = run(broken(), live.Concluded(proposal('coulomb-friction')))
    wrong = live.Estimated(True, ((frozenset({'coulomb-friction'}), 1.0),))
    state, actions = run(state, live.Received(38.0), wrong, wrong)
    assert looks(actions) == []  # the pause
    state, actions = run(state, live.Received(40.0), wrong, live.Received(41.0))
    assert len(looks(actions)) == 1 and 'contradict' in looks(actions)[0]


def test_a_slow_change_is_looked_for_in_the_data_since_it_began():
    """Windows follow it and bands stay good; with those before, the model passed for enough."""
    bands = [live.Judged(0.94)] * 3
    state, actions = run(live.init(SETTINGS), live.Received(60.0), *bands)
    state, actions = run(state, live.Estimated(True, (), 14.0), live.Received(65.5))
    assert actions == []  # as much is waited for as a diagnosis needs
    state, actions = run(state, live.Received(66.0))
    assert [look.since for look in actions] == [46.0]
    # The alarm fell silent and was raised again: it is the same change.
    state, _ = run(state, live.Concluded(), live.Estimated(False, ()))
    state, actions = run(state, live.Estimated(True, (), 9.0), live.Received(80.0))
    assert [look.since for look in actions] == [46.0]
    # Where bands were never good, or something was added, all data are looked at.
    for first in (live.Judged(0.5), live.Estimated(False, ((PLAY, 1.0),))):
        state, _ = run(live.init(SETTINGS), live.Received(15.0), *bands[:2], first)
        weights = state.weights
        _, actions = run(state, live.Estimated(True, weights, 9.0), live.Received(60.0))
        assert [look.since for look in actions if isinstance(look, live.Look)] == [0.0]


def test_what_is_immaterial_to_a_look_is_left_to_forecasts():
    """Each look took friction out, and forecasts had it back, to the end of the stream."""
    both = frozenset({'backlash', 'coulomb-friction'})
    state, _ = run(broken(), live.Concluded(proposal('backlash', 'coulomb-friction')))
    state, _ = run(state, live.Estimated(False, ((both, 0.95), (PLAY, 0.05))), live.Requested())
    less = Proposal(
        (Proposed(choose_model(('backlash',)), 0.9), Proposed(choose_model(), 0.1)), 4e-6
    )
    _, actions = run(state, live.Concluded(less))
    said, carry = actions
    assert said.kind == 'in doubt' and 'coulomb-friction' in said.message
    assert carry.taken_out == () and carry.proposal.material == 4e-6
    told = {frozenset(one.model.effects): one.weight for one in carry.proposal.structures}
    assert told == pytest.approx({PLAY: 0.63, frozenset(): 0.07, both: 0.3})
    # Where another look does without it, and forecasts have not brought it back, it is out.
    after = live.Estimated(False, ((PLAY, 0.7), (both, 0.3)))
    _, actions = run(state, after, live.Concluded(less))
    assert actions[-1].taken_out == ('coulomb-friction',)
    tied = replace(less, structures=(*less.structures, Proposed(choose_model(sorted(both)), 0.1)))
    assert run(state, after, live.Concluded(tied))[1] == []
    # Where nothing of it is found any more, or forecasts doubt it, it is out.
    for found, weight, beside in ((proposal(), 0.95, frozenset()), (less, 0.4, PLAY)):
        doubted, _ = run(state, live.Estimated(False, ((both, weight), (beside, 1.0 - weight))))
        _, actions = run(doubted, live.Concluded(found))
        assert actions[-1].taken_out == tuple(
            sorted(both - set(found.structures[0].model.effects))
        )


def test_what_later_data_contradict_is_taken_out_and_told():
    state, _ = run(broken(), live.Concluded(proposal('coulomb-friction'), left_open=True))
    state, _ = run(state, live.Estimated(False, ((frozenset({'coulomb-friction'}), 0.9),)))
    state, actions = run(state, live.Received(60.0), live.Concluded(proposal('backlash')))
    assert carries(actions) == [('backlash',)]
    (told,) = [a for a in actions if isinstance(a, live.Say)]
    assert told.kind == 'taken out' and 'coulomb-friction' in told.message
    state, _ = run(state, live.Estimated(False, ((PLAY, 0.9), (frozenset(), 0.1))))
    _, actions = run(state, live.Requested(), live.Concluded(proposal()))
    assert carries(actions) == [()]


def test_what_forecasts_have_shown_is_not_taken_out_for_a_look_that_shows_nothing():
    """Flow that saturates showed in none of the peaks of a look, and was gone."""
    state, _ = run(broken(), live.Concluded(proposal('backlash')))
    state, _ = run(state, live.Estimated(False, ((PLAY, 1.0),)), live.Requested())
    _, (told, carry) = run(state, live.Concluded(proposal()))
    assert told.kind == 'in doubt' and carry.taken_out == ()
    both = [(one.model.effects, one.weight) for one in carry.proposal.structures]
    assert both == [(('backlash',), 0.5), ((), 0.5)]


def test_what_is_carried_already_is_not_handed_over_again_unless_it_is_in_doubt():
    state, _ = run(broken(), live.Concluded(proposal('backlash'), left_open=True))
    sure = live.Estimated(False, ((PLAY, 0.97), (frozenset(), 0.03)))
    _, actions = run(state, sure, live.Requested(), live.Concluded(proposal('backlash')))
    assert carries(actions) == []
    unsure = live.Estimated(False, ((PLAY, 0.45), (frozenset(), 0.4)))
    _, actions = run(state, unsure, live.Requested(), live.Concluded(proposal('backlash')))
    assert carries(actions) == [('backlash',)]


def test_bands_of_windows_before_the_change_break_nothing():
    state, _ = run(broken(), live.Concluded(proposal('backlash')), live.Carries(12))
    state, actions = run(state, live.Received(99.0), *[live.Judged(0.4, 11)] * 9)
    assert actions == [] and not state.broken
    _, actions = run(state, *[live.Judged(0.4, 12)] * 3)
    assert len(looks(actions)) == 1


def test_nothing_is_carried_where_nobody_asked_for_it():
    state = replace(broken(), settings=replace(SETTINGS, apply=False))
    _, actions = run(state, live.Concluded(proposal('backlash')))
    assert carries(actions) == []
    _, actions = run(state, live.Concluded(proposal('backlash'), apply=True))
    assert carries(actions) == [('backlash',)]
    _, actions = run(broken(), live.Concluded(None, 'it acts in one record only'))
    assert carries(actions) == [] and 'one record' in actions[0].message


def test_another_actuator_begins_anew():
    state, _ = run(broken(), live.Concluded(proposal('backlash'), left_open=True))
    state, actions = run(state, live.Received(0.5), live.Received(500.0))
    assert looks(actions) == [] and math.isnan(state.looked)


def test_an_alarm_during_a_look_causes_no_second_one():
    """It is of samples that the look has seen, or of a model that its answer replaces."""
    state, _ = run(broken(20.0), live.Received(35.0), *[live.Judged(0.95)] * 3)
    state, actions = run(state, *[live.Judged(0.5)] * 3, live.Estimated(True, ()))
    assert looks(actions) == []
    state, actions = run(state, live.Concluded(proposal('backlash')), live.Received(36.0))
    assert carries(actions) == [('backlash',)] and looks(actions) == []
    # A model that is no better is told by its own bands.
    state, actions = run(state, *[live.Judged(0.5)] * 3)
    assert len(looks(actions)) == 1


def watched(state, upto, bands=None):
    """When it looks, where bands are bad and no look finds anything; the state then."""
    asked = []
    while state.seconds < upto:
        now = state.seconds + 1.0
        coverage = 0.5 if bands is None else bands(now)
        state, actions = run(state, live.Received(now), live.Judged(coverage))
        if looks(actions):
            asked.append(now)
            state, _ = run(state, live.Concluded(why_not='nothing is supported'))
    return asked, state


def test_while_an_alarm_stands_it_looks_again_as_data_since_it_began_become_twice_as_many():
    state, _ = run(broken(20.0), live.Concluded(why_not='nothing is supported'))
    assert watched(state, 100.0)[0] == [30.0, 40.0, 60.0, 100.0]


def test_what_begins_in_mid_stream_is_waited_for_and_looked_at_again_soon():
    """Twice as many data as the whole stream before would be a minute later."""
    asked, state = watched(live.init(SETTINGS), 70.0, lambda now: 0.95 if now < 45.0 else 0.3)
    # Two good bands and a bad one tell it; 5 s of it are waited for.
    assert asked == [50.0, 60.0]
    assert state.alarm == 45.0


def changed(state, weights=(), coverage=0.3):
    """What a stream does that was sound and changes at 45 s of it."""
    _, state = watched(state, 44.0, lambda now: 0.95)
    state, _ = run(state, live.Estimated(False, weights))
    actions = []
    while not looks(actions):
        now = state.seconds + 1.0
        bands = live.Judged(0.95 if now < 45.0 else coverage)
        state, actions = run(state, live.Received(now), bands)
    return state, next(action for action in actions if isinstance(action, live.Look))


@pytest.mark.parametrize('coverage', [0.3, 0.0])
def test_a_sound_machine_that_changes_is_looked_at_from_its_last_good_band_on(coverage):
    """Bands that cover nothing bring the mean of many down at once: no lasting change, either."""
    state, look = changed(live.init(SETTINGS), coverage=coverage)
    assert (look.since, state.seconds) == (44.0, 50.0)
    # What was found in 6 s of it is looked at again in 12 s where it is open, and in twice the
    # minimum where it is not: not in 100 s.
    carried = live.Estimated(False, ((PLAY, 1.0),))
    for left_open, again in ((True, 60.0), (False, 84.0)):
        found, _ = run(state, live.Concluded(proposal('backlash'), left_open=left_open))
        found, actions = run(found, carried, live.Received(again - 0.5))
        assert looks(actions) == []
        _, actions = run(found, live.Received(again))
        assert [action.since for action in actions] == [44.0]


def test_what_changes_beside_an_addition_is_looked_at_from_the_beginning():
    """The addition may be what was wrong, and what was learned with it."""
    _, look = changed(live.init(SETTINGS), ((PLAY, 1.0),))
    assert look.since == 0.0


def test_an_addition_that_a_look_does_not_support_is_carried_beside_eq_2():
    sure = live.Estimated(False, ((frozenset({'coulomb-friction'}), 1.0),))
    undecided = live.Concluded(None, 'nothing is supported that could be added', True)
    supported = replace(undecided, supported=frozenset({'coulomb-friction', 'delay'}))
    against = replace(undecided, supported=frozenset())
    state, _ = run(broken(), live.Concluded(proposal('coulomb-friction')), sure, live.Requested())
    assert carries(run(state, undecided)[1]) == carries(run(state, supported)[1]) == []
    _, (told, carry) = run(state, against)
    assert told.kind == 'in doubt' and 'coulomb-friction' in told.message
    both = [(one.model.effects, one.weight) for one in carry.proposal.structures]
    assert both == [(('coulomb-friction',), 0.5), ((), 0.5)]


def test_coverage_that_is_somewhat_low_for_long_is_a_break_too():
    """An error of the noise's own size: 84 % of the samples, never below the limit."""
    state, actions = run(live.init(SETTINGS), live.Received(30.0), *[live.Judged(0.84)] * 11)
    assert actions == [] and state.trusted
    state, actions = run(state, live.Judged(0.84))
    assert len(looks(actions)) == 1 and '84%' in looks(actions)[0] and not state.trusted
    healthy = np.random.default_rng(1).normal(0.95, 0.02, 500)
    _, actions = run(live.init(SETTINGS), live.Received(30.0), *map(live.Judged, healthy))
    assert actions == []


def found_play(alpha_2, spread):
    """What a proposal is made of: play, sure, and normal draws of alpha_2 that know no box."""
    rng = np.random.default_rng(5)
    joint = np.array([134.0, 1.1e9, 0.0, 0.5, 6e-5]) * np.exp(
        0.01 * rng.standard_normal((4000, 5))
    )
    joint[:, 2] = rng.normal(alpha_2, spread, 4000)
    effect = SimpleNamespace(name='backlash', probability=0.97, rivals=())
    return SimpleNamespace(
        model=Structure(('backlash',)),
        names=(*NAMES, 'backlash'),
        joint=joint,
        structure=('backlash',),
        effects=(effect,),
        onset=None,
        alarm=SimpleNamespace(threshold=5e-6),
        prior=None,
        base={'alpha_2': SimpleNamespace(identified=spread < 1e6)},
    )


def test_what_a_record_leaves_open_is_handed_over_inside_the_box():
    """Laplace draws of alpha_2, 4e6 +- 2e7: six of ten lie where no machine is."""
    command = np.sin(np.linspace(0.0, 60.0, 1000))
    record = Record(1e-3 * command, 1e-3 * command, 0.005, 250e3)
    told = proposed(found_play(4e6, 2e7), [record]).structures[0]
    draws = told.known.carried.draws
    assert draws[:, 2].min() >= 0.0 and draws[:, 2].max() <= 1e7
    assert draws[:, 0].mean() == pytest.approx(134.0, rel=2e-3)
    assert 0.0 < told.model.start[2] < 1e7
    # Where hardly any lies inside nothing is known; the structure is carried all the same.
    told = proposed(found_play(-1e9, 1e7), [record]).structures[0]
    assert told.known is None and told.model.effects == ('backlash',) and told.weight == 0.97


def test_what_one_stiffness_leaves_open_is_handed_over_as_open():
    """Draws that lie around a fit along the ridge, at 7 MN/m where the truth may be 1."""
    command = np.sin(np.linspace(0.0, 60.0, 1000))
    record = Record(1e-3 * command, 1e-3 * command, 0.005, 250e3)
    found = found_play(7e6, 3e5)
    closed = proposed(found, [record]).structures[0].known.carried.draws
    assert closed[:, 2].std() == pytest.approx(3e5, rel=0.1)
    found.base['alpha_2'].identified = False
    told = proposed(found, [record]).structures[0]
    draws, (lower, upper) = told.known.carried.draws, told.model.bounds
    assert ((draws >= lower) & (draws <= upper)).all()
    # Of the box alone (k + alpha_2)^3 is uniform between what the other bounds leave.
    oil = (draws[:, 2] + 250e3) ** 3
    assert oil.mean() / oil.max() == pytest.approx(0.5, abs=0.05)
    # What the record does tell is as it was.
    ratio = draws[:, 1] / (draws[:, 2] + 250e3)
    before = found.joint[:, 1] / (found.joint[:, 2] + 250e3)
    ends = np.quantile(before, [0.1, 0.9])
    assert np.quantile(ratio, [0.1, 0.9]) == pytest.approx(ends, rel=0.01)
    # A calibration tells where on the ridge the machine is.
    for names, spread in ((NAMES, 3e5), (('beta_1',), draws[:, 2].std())):
        found.prior = SimpleNamespace(names=names)
        kept = proposed(found, [record]).structures[0].known.carried.draws
        assert kept[:, 2].std() == pytest.approx(spread, rel=0.1)


def test_an_offset_is_told_and_not_carried():
    """A window's likelihood takes the level out: forecasts of either name mean nothing."""
    command = np.sin(np.linspace(0.0, 60.0, 1000))
    record = Record(1e-3 * command, 1e-3 * command, 0.005, 250e3)

    def finding(name, *rivals):
        told = [SimpleNamespace(name=n, effects=(n,), tied=True, probability=0.45) for n in rivals]
        row = {'probability': 0.5, 'alternatives': rivals, 'rivals': tuple(told), 'records': ()}
        return SimpleNamespace(name=name, **row)

    found = found_play(1e6, 1e4)
    offset = finding('bias', 'valve-null')
    found.structure = ('backlash', 'bias')
    found.effects, found.names = (*found.effects, offset), (*found.names, 'bias')
    found.joint = np.column_stack([found.joint, np.full(len(found.joint), 1e-5)])
    carried = proposed(found, [record]).structures
    assert [one.model.effects for one in carried] == [('backlash',), ()]
    assert carried[0].known.carried.names == (*NAMES, 'backlash') and carried[0].weight == 0.97

    found.structure, found.effects = ('bias',), (offset,)
    found.verdict, found.learned, found.doubts = 'missing-effect', (), ()
    found.error = SimpleNamespace(removed_ci=(0.9, 1.0))
    told = concluded(found, [record])
    assert told.proposal is None and not told.left_open and 'level' in told.why_not

    # In doubt it is looked at again, and a model that is enough takes nothing back.
    found.doubts = ('no posterior was reached',)
    assert concluded(found, [record]).left_open
    found.verdict, found.structure, found.effects = 'none', (), ()
    told = concluded(found, [record])
    assert told.proposal is None and told.left_open
    found.doubts = ()
    told = concluded(found, [record])
    assert told.proposal is not None and not told.left_open


def test_forecasts_that_are_far_off_where_few_samples_are_break_the_band():
    """A limit that takes off a few peaks: 95 % are covered, and the others are off by much."""
    judged = [live.Judged(0.95, error=3.0 if i % 3 == 0 else 1.0) for i in range(12)]
    state, actions = run(live.init(SETTINGS), live.Received(30.0), *judged)
    assert len(looks(actions)) == 1 and 'off by 1.8 times' in looks(actions)[0]
    assert not state.trusted
    # In mid-stream it is looked at what came since the last good band, when there is enough of it.
    _, state = watched(live.init(SETTINGS), 44.0, lambda now: 0.95)
    actions = []
    while not looks(actions):
        peaks = live.Received(state.seconds + 1.0), live.Judged(0.95, error=4.0)
        state, actions = run(state, *peaks)
    assert 'off by' in looks(actions)[0] and state.seconds == 44.0 + SETTINGS.minimum
    assert [action.since for action in actions if isinstance(action, live.Look)] == [44.0]
    glitch = [live.Judged(0.95, error=200.0 if i == 5 else 1.0) for i in range(12)]
    state, actions = run(live.init(SETTINGS), live.Received(30.0), *glitch)
    assert actions == [] and state.trusted
    assert live.Judged.of(0.95, 7, 1e-5, 3.919928e-5, 0.95).error == pytest.approx(1.0, rel=1e-5)
