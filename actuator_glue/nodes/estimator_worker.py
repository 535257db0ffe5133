"""What the estimator's worker process does: compute windows within their time budget."""

from __future__ import annotations

import math
import statistics
import time
from collections import deque
from typing import NamedTuple

from actuator_glue.api.tracking import FREQUENCIES, RecordTracking, window_tracking
from actuator_glue.online.channels import fault
from actuator_glue.online.job import WindowResult, renew, run
from actuator_glue.online.window_posterior import Job, WindowFit
from actuator_glue.workers.warm import warm_prior, warm_windows
from actuator_glue.workers.worker import Tell

# From the worker to the published message [s].
ON_THE_WAY = 5e-3
# Share of the time budget that is left to whatever else the computer does meanwhile.
SLACK = 0.08


class _Lately:
    """How long something took lately, one stall or two among the last times left out.

    At most twice the median of the last times: a computer that stalls once makes one window late,
    and later windows keep their time for sampling.
    """

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=7)

    @property
    def seconds(self) -> float:
        """How long it will take [s]; 0 where nothing is known."""
        if not self._times:
            return 0.0
        return min(max(self._times), 2.0 * statistics.median_low(self._times))

    def add(self, seconds: float) -> None:
        """Note how long it took [s]."""
        self._times.append(seconds)

    def fade(self) -> None:
        """Forget the oldest of the last times."""
        if self._times:
            self._times.popleft()

    def forget(self) -> None:
        """Begin anew."""
        self._times.clear()


# Times of what follows a window's sampling, and of its tracking numbers alone; per worker.
_REPORT, _TRACKING = _Lately(), _Lately()


class Tracked(NamedTuple):
    """Tracking numbers of a window whose result went ahead.

    Attributes:
        window: its running number.
        stamp_ns: acquisition time of its last sample [ns since 1970].
        actuator: name of the actuator.
        numbers: how the actuator followed its command.
    """

    window: int
    stamp_ns: int
    actuator: str
    numbers: RecordTracking


class Afterwards(NamedTuple):
    """What is found of a window whose result went ahead.

    Attributes:
        fault: what speaks against the stream's channels, as `channels.fault` says it.
        tracked: delay and amplitude at the frequencies; None where the deadline leaves no time
            for them, or without a posterior.
    """

    fault: str | None
    tracked: Tracked | None


def compute(job: Job, deadline: float, frequencies: tuple[float, ...], tell: Tell) -> Afterwards:
    """Compute a job in the worker and send its WindowResult before a monotonic time [s].

    Sampling ends early enough for what follows it, as long as that took lately. What nobody waits
    for comes afterwards.

    Args:
        job: what to compute.
        deadline: when the result has to be there [s].
        frequencies: at which delay and amplitude are wanted [Hz].
        tell: sends the result.
    """
    last = time.monotonic()
    end = deadline - 1.3 * _REPORT.seconds - ON_THE_WAY - SLACK * job.settings.time_budget

    def expired() -> bool:
        nonlocal last
        last = time.monotonic()
        return last > end

    result = run(job, expired)
    _REPORT.add(time.monotonic() - last)
    # Bands are waited for, these numbers are not. On one core with real-time priority the node
    # publishes nothing before the worker rests.
    tell(result)
    time.sleep(ON_THE_WAY)
    # First what has a deadline.
    tracked, stretch = _tracked(result, deadline, frequencies), job.window.stretch
    return Afterwards(None if stretch is None else fault(stretch), tracked)


def _tracked(
    result: WindowResult, deadline: float, frequencies: tuple[float, ...]
) -> Tracked | None:
    now = time.monotonic()
    if now > deadline - 1.3 * _TRACKING.seconds - ON_THE_WAY:
        _TRACKING.fade()  # slow moments must not end them for good
        return None
    numbers = window_tracking(result, frequencies)
    _TRACKING.add(time.monotonic() - now)
    if numbers is None:
        return None
    record = result.window.record
    stamp = record.stamp_ns(len(record) - 1)
    return Tracked(result.window.number, stamp, record.actuator, numbers)


def compute_beside(job: Job, tell: Tell) -> WindowFit:
    """Sample a structure beside the likeliest one, in a worker of its own."""
    return renew(job)


def warm_up() -> None:
    """Compile and import what windows need, and learn how long they take once that is done.

    Without a time limit: a window that is cut short does not call all functions that run live.
    """

    def compute_whole(job: Job) -> WindowResult:
        return computed(job, math.inf)[0]

    warm_windows(compute_whole)
    warm_windows(compute_whole, windows=1, carried=warm_prior())
    # Compiling does not count: ten windows would find no time left for sampling.
    _REPORT.forget()
    _TRACKING.forget()
    warm_windows(compute_whole, swap=False, windows=1)


def computed(job: Job, deadline: float) -> tuple[WindowResult, Tracked | None]:
    """Return what `compute` tells and finds afterwards at the usual frequencies."""
    told: list[WindowResult] = []
    afterwards = compute(job, deadline, FREQUENCIES, told.append)
    return told[0], afterwards.tracked
