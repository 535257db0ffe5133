"""What the estimator's worker process does: compute windows within their time budget."""

from __future__ import annotations

import time
from typing import NamedTuple

from actuator_glue.api.tracking import FREQUENCIES, RecordTracking, window_tracking
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.sampling import Job
from actuator_glue.workers.warm import warm_windows
from actuator_glue.workers.worker import Tell

# From the worker to the published message [s].
ON_THE_WAY = 5e-3
# Share of the time budget that is left to whatever else the computer does meanwhile.
SLACK = 0.08


class _Reserve:
    """How long a window still takes once its sampling has ended; lives in the worker.

    Attributes:
        seconds: without its tracking numbers.
        tracking: for these alone.
    """

    seconds = 0.0
    tracking = 0.0


class Tracked(NamedTuple):
    """Tracking numbers of a window, which went ahead.

    Attributes:
        window: its running number.
        stamp_ns: acquisition time of its last sample [ns since 1970].
        actuator: name of the actuator.
        numbers: how that followed its command.
    """

    window: int
    stamp_ns: int
    actuator: str
    numbers: RecordTracking


def compute(
    job: Job, deadline: float, frequencies: tuple[float, ...], tell: Tell
) -> Tracked | None:
    """Compute a job in the worker and tell its WindowResult by a monotonic time [s].

    Sampling ends early enough for what follows it, as long as that took lately. Tracking numbers,
    delay and amplitude at the frequencies [Hz], come afterwards where the deadline leaves time for
    them; None where not, or without a posterior.
    """
    last = time.monotonic()
    kept = ON_THE_WAY + SLACK * job.settings.time_budget

    def expired() -> bool:
        nonlocal last
        last = time.monotonic()
        return last > deadline - 1.3 * _Reserve.seconds - kept

    result = run(job, expired)
    now = time.monotonic()
    _Reserve.seconds = max(now - last, 0.8 * _Reserve.seconds)
    # Bands are waited for, these numbers are not. On one core with real-time priority the node
    # publishes nothing before the worker rests.
    tell(result)
    time.sleep(ON_THE_WAY)
    now = time.monotonic()
    if now > deadline - 1.3 * _Reserve.tracking - ON_THE_WAY:
        _Reserve.tracking *= 0.9  # one slow moment must not end them for good
        return None
    numbers = window_tracking(result, frequencies)
    _Reserve.tracking = max(time.monotonic() - now, 0.8 * _Reserve.tracking)
    if numbers is None:
        return None
    record = result.window.record
    stamp = record.stamp_ns(len(record) - 1)
    return Tracked(result.window.number, stamp, record.actuator, numbers)


def warm_up() -> None:
    """Compile and import what windows need, and learn how long they take once that is done."""
    for windows, swap in (3, True), (1, False):
        # The first time compiling counts: ten windows would find no time left for sampling.
        _Reserve.seconds = _Reserve.tracking = 0.0
        warm_windows(lambda job: computed(job, time.monotonic() + 60.0)[0], swap, windows)


def computed(job: Job, deadline: float) -> tuple[WindowResult, Tracked | None]:
    """Return what `compute` tells and returns, with the numbers at the usual frequencies."""
    told: list[WindowResult] = []
    tracked = compute(job, deadline, FREQUENCIES, told.append)
    return told[0], tracked
