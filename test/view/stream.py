"""Messages of a suite that runs, as the page gets them, without ROS."""

import json
from types import SimpleNamespace as Message
from typing import Any

import numpy as np

from actuator_glue.view.frames import Frames, Wanted
from actuator_glue.view.history import History
from actuator_glue.view.intake import Intake

RATE = 1000.0


def frame(intake: Intake, wanted: Wanted) -> bytes:
    """Return what a page is shown first."""
    return Frames(intake).next(wanted, 0.0)


def block(first: int, count: int) -> Any:
    """Return a SampleBlock of a slow sine of 2 mm, what is measured a little late."""
    time = np.arange(first, first + count) / RATE
    command, measured = (2e-3 * np.sin(6.0 * (time - late)) for late in (0.0, 0.03))
    header = Message(stamp=Message(sec=0, nanosec=0))
    channels = {'command': command, 'measured': measured, 'force': 250e3 * measured}
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


def posterior(window: int, mean: float = 123.4, **weights: float) -> Any:
    """Return a posterior of one parameter; of structures, where there are weights of any.

    Structures are named as Python can: `Eq2` is Eq. (2), `_` a hyphen, `__` two effects together.
    """
    names = [
        'Eq. (2)' if name == 'Eq2' else name.replace('__', ' + ').replace('_', '-')
        for name in weights
    ]
    count = len(names)
    return Message(
        window=window,
        index=1000 * window,
        samples=1000,
        period=1e-3,
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
        doubts=[],
        structures=names,
        weights=list(weights.values()),
        structure_sizes=[2] * count,
        structure_parameter_names=['beta_1', 'backlash'] * count,
        structure_units=['1/s', 'm'] * count,
        structure_mean=np.array([[mean + i, 4e-5 + 1e-6 * i] for i in range(count)]).ravel(),
        structure_stddev=np.array([2.5, 1e-6] * count),
    )


def response() -> Any:
    """Return a frequency response."""
    return Message(
        headline_frequency=5.0, headline_amplitude=0.9, headline_phase=-1.0, headline_delay=0.0312
    )


def diagnosis(summary: str = 'missing: backlash') -> Any:
    """Return a diagnosis: play, with which Coulomb friction is tied; and what would tell."""
    size = {'mean': 4.1e-5, 'lower': 4.02e-5, 'upper': 4.19e-5, 'unit': 'm', 'identified': True}
    whole = {
        'effects': [
            {
                'name': 'backlash',
                'parameters': {'backlash': size},
                'rivals': [
                    {'name': 'backlash', 'probability': 0.6},
                    {'name': 'coulomb-friction', 'probability': 0.37},
                ],
            }
        ],
        'base': {'beta_1': {}},
        'structure': ['backlash'],
        'structures': [
            {
                'effects': ['coulomb-friction'],
                'parameters': {'beta_1': 120.0, 'coulomb_force': 812.0},
                'units': {'beta_1': '1/s', 'coulomb_force': 'N'},
            }
        ],
        'experiments': [
            {
                'command': 'a slow triangle wave (0.1 Hz)',
                'amplitude': 5e-4,
                'stiffness': 0.0,
                'seconds': 30.0,
                'expected_nats': 41.2,
            }
        ],
    }
    effect = Message(name='backlash', probability=0.6, alternatives=['coulomb-friction'])
    return Message(
        verdict='missing-effect',
        summary=summary,
        reason='asked for',
        effects=[effect],
        advice=['go on'],
        json=json.dumps(whole),
    )


def health(
    name: str = '/estimator', level: bytes = b'\1', message: str = 'R-hat high', **counts: int
) -> Any:
    """Return a DiagnosticArray; of faults by kind how often there was one, `message` the last."""
    pairs = [(f'{kind} (count)', str(n)) for kind, n in counts.items()]
    pairs += [(f'{kind} (last)', message) for kind in counts]
    values = [Message(key=key, value=value) for key, value in pairs]
    return Message(status=[Message(name=name, level=level, message=message, values=values)])


def setup(motion: str = '', stiffness: float = 250e3) -> Any:
    """Return a TestSetup."""
    return Message(
        actuator='north',
        header=Message(frame_id=''),
        specimen_stiffness=stiffness,
        rate=RATE,
        source='a test',
        motion=motion,
    )


def intake(seconds: float, *, capacity: int = 1 << 17, live: bool = True) -> Intake:
    """Return an intake that has taken so many seconds."""
    made = Intake(History(capacity), 'a test', live=live)
    made.take('TestSetup', setup())
    feed(made, 0, round(seconds * RATE))
    return made


def feed(intake: Intake, first: int, count: int, *, size: int = 50) -> None:
    """Feed samples with all that comes with them; 1000 is a multiple of the size of blocks."""
    for at in range(first, first + count, size):
        intake.take('SampleBlock', block(at, size))
        if at % 1000 == 1000 - size:
            intake.take('PredictionBand', band(at + size - 1000, 1000))
            window = at // 1000
            intake.take('PosteriorMoments', posterior(window, **carried(window)))
            intake.take('FrequencyResponseBand', response())
            intake.take('DiagnosticArray', health())
            if window % 50 == 1:
                intake.take('Diagnosis', diagnosis())


def carried(window: int) -> dict[str, float]:
    """Return the structures carried in a window and their weights: Eq. (2), then play comes in."""
    if window < 20:
        return {'Eq2': 1.0}
    plain = float(0.9 * np.exp(-0.3 * (window - 20)))
    play = (1.0 - plain) * (0.6 + 0.35 * np.tanh((window - 60) / 10.0))
    found = {'backlash': play, 'coulomb_friction': 1.0 - plain - play, 'Eq2': plain}
    carries = {name: weight for name, weight in found.items() if weight > 0.01}
    return {name: float(weight / sum(carries.values())) for name, weight in carries.items()}
