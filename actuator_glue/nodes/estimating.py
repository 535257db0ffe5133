"""What the estimator's worker process does: compute windows within their time budget."""

from __future__ import annotations

import time

from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.sampling import Job
from actuator_glue.workers.warm import warm_windows
from actuator_glue.workers.worker import Tell

# From the worker to the published message [s].
ON_THE_WAY = 5e-3
# Share of the time budget that is left to whatever else the computer does meanwhile.
SLACK = 0.08


class _Reserve:
    """How long a window still takes once its sampling has ended; lives in the worker."""

    seconds = 0.0


def compute(job: Job, deadline: float, tell: Tell) -> WindowResult:
    """Compute a job in the worker so that it is done at a monotonic time [s].

    Sampling ends early enough for what follows it, as long as that took lately.
    """
    last = time.monotonic()
    kept = ON_THE_WAY + SLACK * job.settings.time_budget

    def expired() -> bool:
        nonlocal last
        last = time.monotonic()
        return last > deadline - 1.3 * _Reserve.seconds - kept

    result = run(job, expired)
    after = time.monotonic() - last
    _Reserve.seconds = max(after, 0.8 * _Reserve.seconds)
    return result


def warm_up() -> None:
    """Compile and import what windows need, and learn how long they take once that is done."""
    for _ in range(2):
        # The first time compiling counts: ten windows would find no time left for sampling.
        _Reserve.seconds = 0.0
        warm_windows(lambda job: compute(job, time.monotonic() + 60.0, lambda _: None))
