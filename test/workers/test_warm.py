"""What a worker learns while it warms up."""

import math
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from actuator_glue.nodes import estimator_worker
from actuator_glue.nodes.estimator_worker import Tracked, computed
from actuator_glue.online import job as window_job
from actuator_glue.online.job import WindowResult
from actuator_glue.online.window_posterior import Job
from actuator_glue.workers.warm import warm_windows


def test_compiling_does_not_count_as_what_a_window_takes() -> None:
    """The first run after installing left the first eleven windows no time to sample."""
    estimator_worker._REPORT.add(30.0)
    estimator_worker.warm_up()
    assert 0.0 < estimator_worker._REPORT.seconds < 0.4


CALLED = """
import gc, math, pickle, sys
import numpy as np
from numba.core.dispatcher import Dispatcher
from actuator_glue.inference.choice import choose_model
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.nodes import estimator_worker as worker
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.playback import give, stream
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.structures import Proposal, Proposed
from actuator_glue.records import Record

def compiled():
    every = [d for d in gc.get_objects() if isinstance(d, Dispatcher)]
    return {(d.py_func.__name__, str(s)) for d in every for s in d.overloads}

def live(effects=(), stiffness=1e5, hold='zoh', model=None, **settings):
    rate, rng = 250.0, np.random.default_rng(1)
    command = 1e-3 * np.sin(9.0 * np.arange(1000) / rate)
    measured = command + 1e-5 * rng.standard_normal(1000)
    settings = {'window': 2.0, 'evaluations': 2000, 'start_evaluations': 2000} | settings
    estimator = Estimator(EstimatorSettings(**settings), choose_model(), live=True)
    for item in stream(Record(command, measured, 1 / rate, stiffness, hold=hold)):
        give(estimator, item)
        while (job := estimator.next_job()) is not None:
            job = pickle.loads(pickle.dumps(job))  # as it comes through a pipe
            estimator.finish(worker.computed(job, math.inf)[0])
            if job.window.number == 0:
                estimator.set_model(model or choose_model(effects))

worker.warm_up()
known = compiled()
assert len(known) > 30
live(stiffness=0.0, hold='linear')
live(likelihood='gaussian', prior='sequential')
live(('drift', 'backlash'), prior='sequential')
pair = Proposed(choose_model(('backlash',)), 0.6), Proposed(choose_model(), 0.4)
live(model=Proposal(pair), start_evaluations=8000)
names = sorted(CATALOGUE) if 'all' in sys.argv else ['hum', 'valve-hysteresis', 'sensor-curve']
for name in names:
    live((name,))
print(sorted(compiled() - known))
"""


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize('which', ['some', 'all'])
def test_a_live_stream_has_nothing_left_to_compile(which: str) -> None:
    """Eight band kernels were compiled in the stream of a cold launch: 320 s to a posterior."""
    done = subprocess.run(
        [sys.executable, '-c', CALLED, which], capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == '[]', done.stdout + done.stderr


@pytest.mark.slow
def test_warming_up_is_cut_short_by_no_deadline(monkeypatch: pytest.MonkeyPatch) -> None:
    """After a minute of compiling it was called ready, with half still to be compiled."""
    ends: list[float] = []
    evaluations = 0

    def note(job: Job, deadline: float) -> tuple[WindowResult, Tracked | None]:
        nonlocal evaluations
        ends.append(deadline)
        found = computed(job, deadline)
        assert not found[0].failure and found[0].scored is not None
        evaluations += found[0].evaluations
        return found

    monkeypatch.setattr(estimator_worker, 'computed', note)
    estimator_worker.warm_up()
    assert len(ends) > 5 and set(ends) == {math.inf}
    # Nobody waits for more than it takes to call all of them: half of a start was sampling.
    assert evaluations < 60_000


@pytest.mark.slow
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
    for _ in range(7):
        estimator_worker._TRACKING.add(100.0)
    done = len(found)
    late = estimator_worker.time.monotonic() + 60.0
    warm_windows(lambda job: note(job, late)[0], swap=False)
    assert not any(found[done:])
    for _ in range(10):
        warm_windows(lambda job: note(job, late)[0], swap=False)
    assert found[-1] is not None


class Clock:
    """A computer on which time passes as it is told."""

    def __init__(self) -> None:
        self.now = 0.0

    def monotonic(self) -> float:
        """Return the time [s]."""
        return self.now

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self.now += seconds


@pytest.mark.parametrize('stalls', [{4}, {4, 5}, {4, 9}, {0}])
def test_a_stall_takes_the_time_for_sampling_from_no_other_window(
    stalls: set[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One slow moment after the sampling of a window left the next ten no time for theirs."""
    clock, sampled = Clock(), []

    def window(job: Job, expired: Callable[[], bool]) -> None:
        began = clock.now
        while not expired():
            clock.sleep(1e-3)
        sampled.append(clock.now - began)
        clock.sleep(0.7 if len(sampled) - 1 in stalls else 0.04)

    monkeypatch.setattr(estimator_worker, 'time', clock)
    monkeypatch.setattr(estimator_worker, 'run', window)
    monkeypatch.setattr(estimator_worker, 'window_tracking', lambda *_: None)
    job: Any = SimpleNamespace(
        settings=SimpleNamespace(time_budget=0.8), window=SimpleNamespace(stretch=None)
    )
    estimator_worker._REPORT.forget()
    estimator_worker._TRACKING.forget()
    for _ in range(20):
        estimator_worker.compute(job, clock.now + 0.8, (5.0,), lambda _: None)
    usual = sampled[3] if 0 not in stalls else sampled[-1]
    assert 0.6 < usual < 0.75
    starved = [n for n, seconds in enumerate(sampled) if seconds < 0.9 * usual]
    assert len(starved) <= 2
    # A computer that has become slow for good is reckoned with.
    stalls.update(range(20, 40))
    for _ in range(8):
        estimator_worker.compute(job, clock.now + 0.8, (5.0,), lambda _: None)
    assert sampled[-1] < 0.1


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
