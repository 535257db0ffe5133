"""What a worker does before it says that it is ready."""

from __future__ import annotations

import itertools
import pickle
from collections.abc import Callable

import numpy as np

from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.model.parameters import NAMES
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.playback import stream
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Preview
from actuator_glue.online.window_posterior import Job
from actuator_glue.records import Record
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup

# Between them they call all that effects are computed with, which a test holds to the catalogue.
# One of them twice: the second window of a model begins where its first one ended.
SWAPS = (('backlash',), ('hum',), ('hum',), ('sensor-curve',))


def warm_windows(
    compute: Callable[[Job], WindowResult] = run,
    swap: bool = True,
    windows: int = 1 + len(SWAPS),
    carried: Carried | None = None,
) -> None:
    """Compile and import what windows need, by estimating a short stream as a live one.

    Args:
        compute: computes a job.
        swap: whether the model may be swapped for one with effects, too.
        windows: how many are estimated; with `swap` all but the first have effects.
        carried: draws that the windows' priors begin with; None for the box.
    """
    rng, count = np.random.default_rng(0), 200 * (windows + 2)
    command = 1e-3 * np.sin(2 * np.pi * 2.0 * np.arange(count) / 200.0)
    measured = command + 1e-5 * rng.standard_normal(count)
    settings = EstimatorSettings(
        window=3.0,
        time_budget=1.0,
        # As few as may be: nothing more is called by more of them.
        evaluations=2000,
        start_evaluations=8000,
        prior='box' if carried is None else 'calibration',
    )
    estimator = Estimator(settings, choose_model(), carried=carried)
    estimator.preview(Preview(0, 1 / 200.0, command))
    swaps = itertools.cycle(SWAPS)
    for item in stream(Record(command, measured, 1 / 200.0, 1e5)):
        if isinstance(item, StreamSetup):
            estimator.setup(item)
        elif isinstance(item, Block):
            estimator.push(item)
        while (job := estimator.next_job()) is not None:
            # As it comes through a pipe: arrays lose their write protection, which numba sees.
            job = pickle.loads(pickle.dumps(job))
            estimator.finish(compute(job))
            # A diagnosis may swap the model in mid-stream; nothing must wait for a compiler then.
            if swap:
                estimator.set_model(choose_model(next(swaps)))


def warm_prior() -> Carried:
    """Return draws about a usual actuator, for windows with a prior of their own."""
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    rng = np.random.default_rng(1)
    return Carried(NAMES, theta * np.exp(0.05 * rng.standard_normal((100, 4))))
