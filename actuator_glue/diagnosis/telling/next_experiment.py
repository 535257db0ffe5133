"""Which test would tell tied structures apart: the expected evidence of a menu of tests.

Of two structures that fit the records alike, each predicts another displacement in a new test.
The expected evidence for the one if it is true is half the squared difference over the noise's
variance, after the other has taken up what the uncertainty of its own parameters allows (Laplace
approximation of the expected log ratio; Box & Hill 1967).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.space import Space, jacobian
from actuator_glue.json_value import Json
from actuator_glue.model import commands
from actuator_glue.model.effects import Scale
from actuator_glue.records import Array, Record

_RATE = 256.0  # Hz
_DURATION = 30.0  # s
_SEED = 0


@dataclass(frozen=True, slots=True)
class Experiment:
    """One test of the menu.

    Attributes:
        text: the command, for people.
        amplitude: of the command [m].
        stiffness: of the specimen [N/m].
        nats: expected evidence between what is tied; the least over the tied set.
    """

    text: str
    amplitude: float
    stiffness: float
    nats: float = 0.0

    def to_json(self) -> Json:
        """Return the JSON object."""
        return {
            'command': self.text,
            'amplitude': self.amplitude,
            'stiffness': self.stiffness,
            'seconds': _DURATION,
            'expected_nats': self.nats,
        }

    def sentence(self) -> str:
        """Return the test in words."""
        return (
            f'{self.text} of {1e3 * self.amplitude:.2g} mm at k = {self.stiffness / 1e3:g} kN/m '
            f'({_DURATION:g} s, {self.nats:.3g} nats expected)'
        )


def ranked(
    best: Trial, rivals: Iterable[Trial], scorer: Scorer, scale: Scale, noise: float
) -> tuple[Experiment, ...]:
    """Rank the menu by the evidence that is expected against the nearest rival.

    Args:
        best: the structure that was found.
        rivals: structures that the records cannot tell from it.
        scorer: noise of the records, for what they know of the rivals' parameters.
        scale: sizes of the test.
        noise: rms of the noise [m].
    """
    knowledge = [(rival, _precision(rival, scorer)) for rival in rivals]
    out = []
    for record, test in _menu(scorer.data, scale):
        nats = min(_expected(best, rival, known, record, noise) for rival, known in knowledge)
        out.append(replace(test, nats=nats))
    return tuple(sorted(out, key=lambda e: -e.nats))


def _precision(trial: Trial, scorer: Scorer) -> Array:
    """Precision of a structure's parameters from the records, working coordinates (p, p)."""
    jac = scorer.whiten(trial.fit.jacobian)
    return np.asarray(jac @ jac.T)


def _menu(data: Data, scale: Scale) -> Iterable[tuple[Record, Experiment]]:
    """Sweeps, shaking and slow triangles at the strokes and stiffnesses of the test."""
    stiffnesses = sorted({0.0, *(r.known_stiffness() for r in data.records)})
    stroke, speed = scale.stroke, scale.velocity
    n = round(_RATE * _DURATION)
    time = np.arange(n) / _RATE
    ramp = np.minimum(1.0, np.arange(n + 1) / _RATE)
    for share in (1.0, 0.25):
        size = share * stroke
        top = min(20.0, max(2.0, speed / (2.0 * np.pi * size)))
        up = commands.sweep(_RATE, _DURATION, 0.1, top, size)
        shaking = commands.earthquake(_RATE, _DURATION, size, seed=_SEED)
        triangle = size * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * 0.1 * time))
        for text, command in (
            (f'an up-sweep 0.1 to {top:.2g} Hz', up),
            (f'a down-sweep {top:.2g} to 0.1 Hz', np.asarray(up)[::-1] * ramp),
            ('an earthquake', shaking),
            ('a slow triangle wave (0.1 Hz)', triangle),
        ):
            for k in stiffnesses:
                u = np.asarray(command, dtype=np.float64)
                record = Record(u, np.zeros(len(u)), 1.0 / _RATE, k)
                yield record, Experiment(text, size, k)


def _expected(best: Trial, rival: Trial, known: Array, record: Record, noise: float) -> float:
    """Expected evidence for the best over a rival from one more record [nats]."""
    data = Data.whole([record])
    space = Space(rival.model, record.duration)
    z = rival.fit.z[None]
    output = data.simulate(rival.model, space.theta(z))
    difference = (data.simulate(best.model, best.fit.theta[None]) - output)[0] / noise
    if not np.isfinite(difference).all():
        return 0.0
    jac = jacobian(data, rival.model, space, z, output)[0] / noise
    normal = known + jac @ jac.T
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    pull = jac @ difference / scale
    taken = pull @ np.linalg.pinv(normal / np.outer(scale, scale), rcond=1e-10) @ pull
    return float(max(0.0, 0.5 * (difference @ difference - taken)))
