"""What a worker learns while it warms up."""

from dataclasses import replace

import pytest

from actuator_glue.nodes import estimator_worker
from actuator_glue.nodes.estimator_worker import Computed
from actuator_glue.online import job as window_job
from actuator_glue.online.job import WindowResult
from actuator_glue.online.sampling import Job
from actuator_glue.workers.warm import warm_windows
from actuator_glue.workers.worker import Tell


def test_compiling_does_not_count_as_what_a_window_takes() -> None:
    """The first run after installing left the first eleven windows no time to sample."""
    estimator_worker._Reserve.seconds = 30.0
    estimator_worker.warm_up()
    assert estimator_worker._Reserve.seconds < 0.4


def test_tracking_numbers_take_no_time_from_a_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without time left for them there are none; a slow moment is forgotten after some windows."""
    computed: list[estimator_worker.Computed] = []
    asked = estimator_worker.compute

    def note(job: Job, deadline: float, frequencies: tuple[float, ...], tell: Tell) -> Computed:
        computed.append(asked(job, deadline, frequencies, tell))
        return computed[-1]

    monkeypatch.setattr(estimator_worker, 'compute', note)
    estimator_worker.warm_up()
    assert all(c.tracking is not None and 'J2' in c.tracking.predicted for c in computed)
    monkeypatch.setattr(estimator_worker._Reserve, 'tracking', 100.0)
    done = len(computed)
    late = (estimator_worker.time.monotonic() + 60.0, estimator_worker.FREQUENCIES, lambda _: None)
    warm_windows(lambda job: note(job, *late).result, swap=False)
    assert all(c.tracking is None for c in computed[done:])
    for _ in range(10):
        warm_windows(lambda job: note(job, *late).result, swap=False)
    assert computed[-1].tracking is not None


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

    def computed(seconds: float) -> Computed:
        end = estimator_worker.time.monotonic() + seconds
        return estimator_worker.compute(first, end, estimator_worker.FREQUENCIES, lambda _: None)

    assert 'no posterior was reached' in computed(budget).result.failure
    assert not computed(first.seconds).result.failure
