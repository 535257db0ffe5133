"""What windows publish, computed in a process beside the one that samples them."""

from __future__ import annotations

import os
import threading
from collections import deque
from concurrent.futures import Future
from dataclasses import fields, replace
from typing import Any

from actuator_glue.online.job import WindowResult, report
from actuator_glue.online.sampling import Fit, Job
from actuator_glue.workers.warm import warm_windows
from actuator_glue.workers.worker import DIED, DONE, Answer, Tell, Worker


class Reports:
    """Computes `job.report` in another process: for `replay`, whose results are the same.

    A process and not a thread: two threads would hand the interpreter's lock to and fro for longer
    than a report takes. Until the process is ready, and should it die, reports are computed here.
    A script that uses this keeps its own work behind `if __name__ == '__main__'`, as always with
    `multiprocessing`. Use as a context manager.

    Args:
        limits: whether the limits of bands, response and forecast are wanted; otherwise results
            hold the bands' scores only. To carry all of them takes as long as to read the samples.
    """

    def __init__(self, limits: bool = True) -> None:
        self._limits = limits
        self._lock = threading.Lock()
        self._asked: deque[tuple[Future[WindowResult], Job, Fit]] = deque()
        self._gone = _cores() < 2  # nothing is gained on one
        self._worker = None if self._gone else Worker(self._take, _warm)

    def __call__(self, job: Job, fitted: Fit) -> Future[WindowResult]:
        """Return what will be the report."""
        found: Future[WindowResult] = Future()
        with self._lock:
            if self._worker is not None and not self._gone and self._worker.ready.is_set():
                self._asked.append((found, job, fitted))
                # Points to start from are no part of a report.
                self._worker.submit(
                    _others,
                    replace(job, archive=None),
                    replace(fitted, archive=None),
                    self._limits,
                )
                return found
        self._settle(found, job, fitted)
        return found

    def wait(self, seconds: float) -> bool:
        """Wait until the process is ready, for so long at most; return whether it is."""
        return self._worker is not None and self._worker.ready.wait(seconds)

    def _take(self, answer: Answer) -> None:
        with self._lock:
            self._gone |= answer.kind == DIED
            count = len(self._asked) if self._gone else 1
            answered = [self._asked.popleft() for _ in range(count)]
        for found, job, fitted in answered:
            if answer.kind == DONE:
                found.set_result(WindowResult(**_known(job, fitted), **answer.payload))
            else:
                self._settle(found, job, fitted)

    def _settle(self, found: Future[WindowResult], job: Job, fitted: Fit) -> None:
        """Compute here what the process does not or could not."""
        try:
            found.set_result(_report(job, fitted, self._limits))
        except Exception as error:
            found.set_exception(error)

    def __enter__(self) -> Reports:
        return self

    def __exit__(self, *error: object) -> None:
        if self._worker is not None:
            self._worker.close(patience=0.0)


def _cores() -> int:
    # Only Linux says how many this process may use.
    usable = getattr(os, 'sched_getaffinity', None)
    return len(usable(0)) if usable is not None else os.cpu_count() or 1


def _warm() -> None:
    # Effects take a second more, which most replays can do without.
    warm_windows(swap=False)


def _known(job: Job, fitted: Fit) -> dict[str, Any]:
    """Return the fields of a result that whoever asks for it has."""
    return {
        'window': job.window,
        'settings': job.settings,
        'model': job.model,
        'archive': fitted.archive,
    }


def _report(job: Job, fitted: Fit, limits: bool) -> WindowResult:
    result = report(job, fitted)
    if limits:
        return result
    scored = tuple(replace(p, band=p.band.slice(0, 0)) for p in result.scored)
    return replace(result, scored=scored, response=None, forecast=())


def _others(job: Job, fitted: Fit, limits: bool, tell: Tell) -> dict[str, Any]:
    """Return the other fields of a result: half of the bytes need not be sent back."""
    result, known = _report(job, fitted, limits), _known(job, fitted)
    return {f.name: getattr(result, f.name) for f in fields(result) if f.name not in known}
