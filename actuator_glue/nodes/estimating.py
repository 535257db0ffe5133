"""What the estimator's worker process does: compute windows within their time budget."""

from __future__ import annotations

import time

import numpy as np

from actuator_glue.nodes.worker import Tell
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.fitting import choose_model
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.replay import stream
from actuator_glue.online.sampling import Job
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Block, Preview, Setup
from actuator_glue.records import Record

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
    """Compile and import what windows need, by estimating a short stream as a live one."""
    import pickle

    rng = np.random.default_rng(0)
    command = 1e-3 * np.sin(2 * np.pi * 2.0 * np.arange(1200) / 200.0)
    measured = command + 1e-5 * rng.standard_normal(1200)
    settings = EstimatorSettings(
        window=3.0, time_budget=1.0, evaluations=4000, start_evaluations=8000
    )
    estimator = Estimator(settings, choose_model())
    estimator.preview(Preview(0, 1 / 200.0, command))
    for item in stream(Record(command, measured, 1 / 200.0, 1e5)):
        if isinstance(item, Setup):
            estimator.setup(item)
        elif isinstance(item, Block):
            estimator.push(item)
        while (job := estimator.next_job()) is not None:
            # As it comes through a pipe: arrays lose their write protection, which numba sees.
            job = pickle.loads(pickle.dumps(job))
            estimator.finish(compute(job, time.monotonic() + 60.0, lambda _: None))
            # A diagnosis may swap the model in mid-stream; nothing must wait for a compiler then.
            estimator.set_model(choose_model(('backlash',)))
