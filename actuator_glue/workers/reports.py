"""What windows publish, computed in a process beside the one that samples them."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future
from dataclasses import fields, replace
from typing import Any

from actuator_glue.online.job import WindowResult, report
from actuator_glue.online.playback import Sampled, told
from actuator_glue.online.stream import Event
from actuator_glue.online.window_posterior import Job, WindowFit
from actuator_glue.workers.warm import warm_windows
from actuator_glue.workers.worker import DIED, DONE, Answer, Tell, Worker

# Samples of the windows that are handed over together, and windows and events at most: to wake a
# process, and the thread that takes its answer, costs a tenth of a short window's work.
_SAMPLES, _MOST = 20_000, 16
# Such portions that may be out while the next windows are sampled.
_OUT = 2

# The reports of one portion; None where the process did not give them.
_Answered = list[WindowResult] | None


class Reports:
    """Computes `job.report` in another process: for `replay`, whose results are the same.

    A process and not a thread: two threads would hand the interpreter's lock to and fro for longer
    than a report takes. Until the process is ready, and should it die, reports are computed here.
    Use as a context manager.

    Args:
        limits: as `job.report` takes it. To carry all limits of bands takes as long as to read
            the samples.
    """

    def __init__(self, limits: bool = True) -> None:
        self._limits = limits
        self._lock = threading.Lock()
        self._asked: deque[tuple[Future[_Answered], list[Sampled]]] = deque()
        self._gone = _cores() < 2  # nothing is gained on one
        self._worker = None if self._gone else Worker(self._take, _warm)

    def __call__(self, found: Iterable[Event | Sampled]) -> Iterator[WindowResult | Event]:
        """Yield events as they are, and of each window that was sampled its report, in order."""
        waiting: deque[tuple[list[Event | Sampled], Future[_Answered]]] = deque()
        for portion in _portions(found):
            waiting.append((portion, self._ask([t for t in portion if isinstance(t, tuple)])))
            while waiting and (len(waiting) > _OUT or waiting[0][1].done()):
                yield from self._answered(*waiting.popleft())
        while waiting:
            yield from self._answered(*waiting.popleft())

    def wait(self, seconds: float) -> bool:
        """Wait until the process is ready, for so long at most; return whether it is."""
        return self._worker is not None and self._worker.ready.wait(seconds)

    def _ask(self, sampled: list[Sampled]) -> Future[_Answered]:
        answer: Future[_Answered] = Future()
        with self._lock:
            if sampled and self._worker and not self._gone and self._worker.ready.is_set():
                self._asked.append((answer, sampled))
                # Points to start from are no part of a report.
                lean = [(replace(j, archive=None), replace(f, archive=None)) for j, f in sampled]
                self._worker.submit(_others, lean, self._limits)
            else:
                answer.set_result(None)
        return answer

    def _take(self, answer: Answer) -> None:
        with self._lock:
            self._gone |= answer.kind == DIED
            count = len(self._asked) if self._gone else 1
            answered = [self._asked.popleft() for _ in range(count)]
        for future, sampled in answered:
            results = None
            if answer.kind == DONE:
                results = [
                    WindowResult(**_known(*one), **others)
                    for one, others in zip(sampled, answer.payload, strict=True)
                ]
            future.set_result(results)

    def _answered(
        self, portion: list[Event | Sampled], answer: Future[_Answered]
    ) -> Iterator[WindowResult | Event]:
        """Yield a portion's events and reports; what the process did not give is computed here."""
        results = iter(answer.result() or [])
        for thing in portion:
            if isinstance(thing, tuple):
                yield told(next(results, None) or report(*thing, self._limits))
            else:
                yield thing

    def __enter__(self) -> Reports:
        return self

    def __exit__(self, *error: object) -> None:
        if self._worker is not None:
            self._worker.close(patience=0.0)


def _portions(found: Iterable[Event | Sampled]) -> Iterator[list[Event | Sampled]]:
    portion: list[Event | Sampled] = []
    samples = 0
    for thing in found:
        portion.append(thing)
        samples += len(thing[0].window.record) if isinstance(thing, tuple) else 0
        if samples >= _SAMPLES or len(portion) >= _MOST:
            yield portion
            portion, samples = [], 0
    if portion:
        yield portion


def _cores() -> int:
    # Only Linux says how many this process may use.
    usable = getattr(os, 'sched_getaffinity', None)
    return len(usable(0)) if usable is not None else os.cpu_count() or 1


def _warm() -> None:
    # Effects take a second more, which most replays can do without.
    warm_windows(swap=False)


def _known(job: Job, fitted: WindowFit) -> dict[str, Any]:
    """Return the fields of a result that the asking process has already."""
    return {
        'window': job.window,
        'settings': job.settings,
        'model': job.model,
        'frozen': fitted.frozen,
        'archive': fitted.archive,
    }


def _others(sampled: list[Sampled], limits: bool, tell: Tell) -> list[dict[str, Any]]:
    """Return the other fields of results: half of the bytes need not be sent back."""
    found = []
    for job, fitted in sampled:
        result, known = report(job, fitted, limits), _known(job, fitted)
        found.append(
            {f.name: getattr(result, f.name) for f in fields(result) if f.name not in known}
        )
    return found
