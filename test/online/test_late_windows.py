"""Windows that wait, are dropped, fail or end early."""

from dataclasses import replace

import numpy as np
from live import results, same
from online_streams import SETTINGS, record

from actuator_glue.inference.choice import choose_model
from actuator_glue.online.estimator import Estimator, Schedule
from actuator_glue.online.job import WindowResult, fit, run
from actuator_glue.online.playback import stream
from actuator_glue.online.sampling import ADAPT, FIRST
from actuator_glue.online.stream import Dropped, Preview
from actuator_glue.online.structures import Proposal, Proposed
from actuator_glue.setups import StreamSetup


def test_few_windows_wait_live():
    estimator = Estimator(SETTINGS, choose_model(), live=True)
    whole = record(8.0)
    events = []
    for item in stream(whole, 200):
        events += estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
        estimator.next_job()  # the first is never finished
    assert estimator.running is not None
    assert [w.number for w in estimator.waiting] == [9, 10, 11, 12]
    assert [e.number for e in events if isinstance(e, Dropped)] == list(range(1, 9))
    assert estimator.abandon('its process has died')[0].number == 0
    assert estimator.next_job().window.number == 9


def test_nothing_depends_on_a_window_that_failed():
    """A replay leaves it out: its bands must be scored by the next window, live as well."""
    items = list(stream(record(6.0), 50))
    live, told = Estimator(SETTINGS, choose_model(), live=True), []
    for item in items:
        live.setup(item) if isinstance(item, StreamSetup) else live.push(item)
        while (job := live.next_job()) is not None:
            result = run(job)
            if job.window.number in (3, 4):
                result = WindowResult(job.window, SETTINGS, job.model, failure='out of time')
            else:
                told.append(result)
            live.finish(result)
    done = {
        (r.window.record.first_index, r.window.record.start_ns): (r.window.number, r.spent)
        for r in told
    }
    again = results(items, schedule=Schedule(done))
    assert len(again) == len(told) > 4
    assert all(same(one, other) for one, other in zip(told, again, strict=True))


def test_windows_that_are_late_are_dropped_but_never_the_newest():
    estimator = Estimator(SETTINGS, choose_model(), live=True)
    for item in stream(record(3.5), 700):
        estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
    assert [w.number for w in estimator.waiting] == [0, 1, 2, 3]
    assert not estimator.drop(lambda window: False)
    told = estimator.drop(lambda window: window.number < 2)
    assert [(e.number, e.index) for e in told] == [(0, 0), (1, 100)]
    assert [e.number for e in estimator.drop(lambda window: True)] == [2]
    assert [w.number for w in estimator.waiting] == [3]


def test_a_window_that_waits_forecasts_from_its_own_end():
    estimator = Estimator(SETTINGS, choose_model(), live=True)
    whole = record(4.0)
    estimator.preview(Preview(0, whole.period, whole.command))
    for item in stream(whole, 50):
        estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
    job = estimator.next_job()
    start, stop = job.window.end, job.forecast[1]
    assert start < stop < len(whole)
    assert np.array_equal(job.ahead, whole.command[start:stop])


def test_a_window_ends_when_its_draws_will_do():
    items = list(stream(record(4.0)))
    sooner = results(items, settings=replace(SETTINGS, evaluations=8000, ess=200))
    never = results(items, settings=replace(SETTINGS, evaluations=8000, ess=10**6))
    assert len(sooner) == len(never) > 2
    for few, all_of_them in zip(sooner, never, strict=True):
        # Well before the others, the start aside; such a window is a whole one.
        assert few.evaluations < 0.9 * all_of_them.evaluations
        assert few.ess.min() >= 200 and few.rhat.max() <= 0.5 * (1.0 + SETTINGS.rhat_limit)
        assert not few.stopped_early and not all_of_them.stopped_early


def test_a_window_without_time_is_followed_by_one_that_has_more():
    """On a busy computer the next one would end where that did, and so on for ever."""
    estimator = Estimator(SETTINGS, choose_model(), live=True)
    waits = iter(stream(record(30.0), 100))

    def job():
        while (found := estimator.next_job()) is None:
            item = next(waits)
            estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
        return found

    first = job().seconds
    for times in (2.0, 4.0, 8.0, 8.0):
        result = run(estimator.running, lambda share: True)
        assert result.starved and 'give it more time' in result.failure
        estimator.finish(result)
        assert job().seconds == times * first
    estimator.finish(run(estimator.running))
    # Not the first one of its model any more: the budget, and what remains of the patience.
    assert job().seconds == 0.8 * 8.0 * SETTINGS.time_budget
    for _ in range(12):
        estimator.finish(run(estimator.running))
        job()
    assert estimator.running.seconds == SETTINGS.time_budget


def test_a_rival_takes_half_of_the_time_only_from_a_posterior():
    """Whose turn it is waits where the likeliest has none yet, and the next window has more."""
    both = Proposal(
        (Proposed(choose_model(('delay',)), 0.5), Proposed(choose_model(('bias',)), 0.5))
    )
    estimator = Estimator(SETTINGS, both, live=True)
    for item in stream(record(2.5), 100):
        estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
    job = estimator.next_job()
    job = replace(job, rivals=tuple(replace(one, due=True) for one in job.rivals))
    shares = []

    def expired(share):
        shares.append(share)
        return len(shares) > 150 if share == 1.0 else share == 0.125

    fitted = fit(job, expired)
    # All that is usual until there is a posterior, then half of it: what is left is the rival's.
    assert job.usual == 0.25
    assert shares[0] == 0.25 and shares.index(0.125) >= 2 * ADAPT
    assert not fitted.failure
    late = fit(job, lambda share: True)
    assert late.starved and late.failure


def three(settings, computed):
    """The jobs of a live estimator of three structures, computed so."""
    every = ((), ('delay',), ('bias',))
    estimator = Estimator(
        settings, Proposal(tuple(Proposed(choose_model(e), 0.2 if e else 0.6) for e in every))
    )
    for item in stream(record(7.8), 50):
        estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
        while (job := estimator.next_job()) is not None:
            yield job
            estimator.finish(computed(job))


def delayed(job):
    """The second structure's job."""
    return next(one for one in job.rivals if one.model.effects == ('delay',))


def test_the_others_take_turns_as_samples_are_new_not_as_windows_are():
    """Twenty windows a second and each had its turn in every third: all of them came late."""
    settings = replace(SETTINGS, window=2.0, hop=0.2, time_budget=0.2, evaluations=2000)
    # Time for whose turn it is, and nothing left over.
    jobs = three(settings, lambda job: run(job, lambda share: share < 1.0))
    turns = [job.window.number for job in jobs if delayed(job).due]
    # Half of a window is five hops; the first time there is no posterior to wait with.
    assert turns == [3, 9, 15, 21, 27]


def test_nobody_else_has_the_time_that_a_turn_needs_beyond_the_usual():
    def in_vain(job):
        result = run(job, lambda share: share < 1.0)
        late = [replace(one, starved=True, failure='late', archive=None) for one in result.rivals]
        pairs = zip(job.rivals, result.rivals, late, strict=True)
        return replace(result, rivals=tuple(bad if job.due else one for job, one, bad in pairs))

    jobs = three(SETTINGS, in_vain)
    first = [next(jobs) for _ in range(6)]
    told = [(job.seconds, job.usual, [one.due for one in job.rivals]) for job in first[2:]]
    whole = 8.0 * SETTINGS.time_budget
    assert told == [
        (SETTINGS.time_budget, 1.0, [False, False]),
        (whole, 0.125, [True, False]),
        # It has had all there is: the other one has its turn, and this one waits.
        (whole, 0.125, [False, True]),
        (SETTINGS.time_budget, 1.0, [False, False]),
    ]
    assert delayed(first[4]).waited == 0
    # A first posterior may take a second, however short a window's budget is.
    short = replace(first[3], settings=replace(SETTINGS, time_budget=0.01, hop=0.01))
    assert (short.seconds, short.usual) == (FIRST, 0.01)
