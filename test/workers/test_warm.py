"""What a worker learns while it warms up."""

from dataclasses import replace

import pytest

from actuator_glue.nodes import estimator_worker
from actuator_glue.nodes.estimator_worker import Tracked, computed
from actuator_glue.online import job as window_job
from actuator_glue.online.job import WindowResult
from actuator_glue.online.sampling import Job
from actuator_glue.workers.warm import warm_windows


def test_compiling_does_not_count_as_what_a_window_takes() -> None:
    """The first run after installing left the first eleven windows no time to sample."""
    estimator_worker._Reserve.seconds = 30.0
    estimator_worker.warm_up()
    assert estimator_worker._Reserve.seconds < 0.4


def test_tracking_numbers_take_no_time_from_a_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without time left for them there are none; a slow moment is forgotten after some windows."""
    found: list[Tracked | None] = []
    asked = computed

    def note(job: Job, deadline: float) -> tuple[WindowResult, Tracked | None]:
        result, tracked = asked(job, deadline)
        found.append(tracked)
        return result, tracked

    monkeypatch.setattr(estimator_worker, 'computed', note)
    estimator_worker.warm_up()
    assert all(t is not None and 'J2' in t.numbers.predicted for t in found)
    monkeypatch.setattr(estimator_worker._Reserve, 'tracking', 100.0)
    done = len(found)
    late = estimator_worker.time.monotonic() + 60.0
    warm_windows(lambda job: note(job, late)[0], swap=False)
    assert not any(found[done:])
    for _ in range(10):
        warm_windows(lambda job: note(job, late)[0], swap=False)
    assert found[-1] is not None


def test_a_window_is_told_before_its_tracking_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its bands waited 35 ms for numbers that nobody waits for, of a deadline of 50 ms."""
    order: list[str] = []

    def numbers(*_: object) -> None:
        order.append('numbers')

    def told(job: Job) -> WindowResult:
        results: list[WindowResult] = []

        def tell(result: WindowResult) -> None:
            order.append('window')
            results.append(result)

        end = estimator_worker.time.monotonic() + 60.0
        estimator_worker.compute(job, end, estimator_worker.FREQUENCIES, tell)
        return results[0]

    monkeypatch.setattr(estimator_worker, 'window_tracking', numbers)
    warm_windows(told, swap=False)
    assert order
    assert order == ['window', 'numbers'] * (len(order) // 2)


def test_the_first_window_may_take_longer_than_those_after_it() -> None:
    """Cut short it gives no posterior, and the next would begin where it did, for ever."""
    jobs: list[Job] = []

    def note(job: Job) -> WindowResult:
        jobs.append(job)
        return window_job.run(job)

    warm_windows(note, swap=False)
    budget = 1.05 * estimator_worker.ON_THE_WAY
    first, *later = (
        replace(job, settings=replace(job.settings, time_budget=budget)) for job in jobs
    )
    assert all(job.seconds == budget for job in later)

    def fitted(seconds: float) -> WindowResult:
        return computed(first, estimator_worker.time.monotonic() + seconds)[0]

    assert 'no posterior was reached' in fitted(budget).failure
    assert not fitted(first.seconds).failure
