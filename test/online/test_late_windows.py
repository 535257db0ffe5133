"""Windows that wait, are dropped, fail or end early."""

from dataclasses import replace

import numpy as np
from live import results, same
from online_streams import SETTINGS, record

from actuator_glue.inference.choice import choose_model
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.playback import stream
from actuator_glue.online.schedule import Schedule
from actuator_glue.online.stream import Dropped, Preview
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
    # What window 6 would have shown of the channels is not lost with it.
    stretches = [w.stretch for w in estimator.waiting]
    assert [one and (one.first_index, len(one)) for one in stretches] == [(0, 1000), *3 * [None]]
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
        result = run(estimator.running, lambda: True)
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
