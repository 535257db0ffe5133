"""Messages of a suite that runs, as the page gets them, without ROS."""

from types import SimpleNamespace as Message
from typing import Any

import numpy as np

from actuator_glue.view.history import History
from actuator_glue.view.intake import Intake

RATE = 1000.0


def block(first: int, count: int) -> Any:
    """Return a SampleBlock of a slow sine of 2 mm, what is measured a little late."""
    time = np.arange(first, first + count) / RATE
    command, measured = (2e-3 * np.sin(6.0 * (time - late)) for late in (0.0, 0.03))
    header = Message(stamp=Message(sec=0, nanosec=0))
    channels = {'command': command, 'measured': measured, 'force': ()}
    return Message(header=header, index=first, period=1 / RATE, **channels)


def band(first: int, count: int, *, half: float = 0.4e-3) -> Any:
    """Return the scored total band about it."""
    median = block(first, count).measured
    return Message(
        kind='total',
        levels=[0.5, 0.95],
        index=first,
        median=median,
        scored=True,
        forecast=True,
        lower=np.concatenate([median - half / 3, median - half]),
        upper=np.concatenate([median + half / 3, median + half]),
        widest_coverage=0.94,
        widest_level=0.95,
        widest_width=2 * half,
    )


def posterior(window: int, mean: float = 123.4) -> Any:
    """Return a posterior of one parameter."""
    return Message(
        window=window,
        parameter_names=['beta_1'],
        units=['1/s'],
        mean=[mean],
        stddev=[2.5],
        prior_dominated=[False],
        effects=['backlash'],
        rhat_max=1.01,
        ess_min=900.0,
        converged=True,
        nrmse=0.02,
        seconds=0.3,
    )


def response() -> Any:
    """Return a frequency response."""
    return Message(
        headline_frequency=5.0, headline_amplitude=0.9, headline_phase=-1.0, headline_delay=0.0312
    )


def diagnosis(summary: str = 'missing: backlash') -> Any:
    """Return a diagnosis."""
    effect = Message(name='backlash')
    return Message(verdict='missing-effect', summary=summary, effects=[effect], advice=['go on'])


def health(name: str = '/estimator', level: bytes = b'\1', message: str = 'R-hat high') -> Any:
    """Return a DiagnosticArray."""
    return Message(status=[Message(name=name, level=level, message=message)])


def setup() -> Any:
    """Return a TestSetup."""
    return Message(
        actuator='north',
        header=Message(frame_id=''),
        specimen_stiffness=250e3,
        rate=RATE,
        source='a test',
    )


def intake(seconds: float, *, capacity: int = 1 << 17, live: bool = True) -> Intake:
    """Return an intake that has taken so many seconds."""
    made = Intake(History(capacity), 'a test', live=live)
    made.take('TestSetup', setup())
    feed(made, 0, round(seconds * RATE))
    return made


def feed(intake: Intake, first: int, count: int) -> None:
    """Feed samples in blocks of 50 with all that comes with them."""
    for at in range(first, first + count, 50):
        intake.take('SampleBlock', block(at, 50))
        if at % 1000 == 950:
            intake.take('PredictionBand', band(at - 950, 1000))
            intake.take('PosteriorMoments', posterior(at // 1000))
            intake.take('FrequencyResponseBand', response())
            intake.take('DiagnosticArray', health())
            intake.take('Diagnosis', diagnosis())
