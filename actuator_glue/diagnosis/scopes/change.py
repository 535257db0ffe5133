"""Which one thing, changed while a test ran, explains what changed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy

from actuator_glue.diagnosis.score.weights import log_weight
from actuator_glue.diagnosis.thresholds import TELLING
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import rms
from actuator_glue.json_value import Json
from actuator_glue.model.parameters import NAMES

STIFFNESS: Final = 'stiffness'
_MOST = 5.0  # times more or less
_SURE = 0.95  # share of the weight of all that were tried
_TOLERANCE = 1e-3  # of the factor's logarithm


@dataclass(frozen=True, slots=True)
class Change:
    """One thing that is a multiple of what it was.

    Attributes:
        name: a parameter of Eq. (2), or 'stiffness' of the specimen.
        factor: what it is since then over what it was.
        error: rms error since then of what held before, with this factor [m].
    """

    name: str
    factor: float
    error: float

    def sentence(self) -> str:
        """Say what changed; what had the same effect is not known."""
        of = 'the stiffness of the specimen' if self.name == STIFFNESS else self.name
        return f'as if {of} had become {100.0 * self.factor:.3g} % of what it was'

    def to_json(self) -> Json:
        """Return the JSON object of a change."""
        return {'name': self.name, 'factor': self.factor, 'error_m': self.error}


def alone(before: Trial, since: Data, least: float, material: float) -> Change | None:
    """Return the one thing whose change explains the data since then.

    None where nothing does, or where another one does as well.

    Args:
        before: Eq. (2) fitted to the data before.
        since: the data since then.
        least: rms error of Eq. (2) refitted to them [m].
        material: least rms error that matters [m].
    """
    tried = sorted((_best(name, before, since) for name in (*NAMES, STIFFNESS)), key=_error)
    if tried[0].error ** 2 - least**2 >= material**2:
        return None
    weights = [log_weight(c.error, TELLING * material, 1.0) for c in tried]
    sure = weights[0] - np.logaddexp.reduce(weights) >= math.log(_SURE)
    return tried[0] if sure else None


def _error(change: Change) -> float:
    return change.error


def _best(name: str, before: Trial, since: Data) -> Change:
    """Return the change of one thing that leaves least."""

    def left(logarithm: float) -> float:
        factor, theta, data = math.exp(logarithm), before.fit.theta.copy(), since
        if name == STIFFNESS:
            scaled = [factor * r.known_stiffness() for r in since.records]
            data = since.with_setup(stiffness=scaled)
        else:
            theta[NAMES.index(name)] *= factor
        return float(rms(data.target - data.simulate(before.structure, theta)[0]))

    most = math.log(_MOST)
    found = scipy.optimize.minimize_scalar(
        left, bounds=(-most, most), method='bounded', options={'xatol': _TOLERANCE}
    )
    return Change(name, math.exp(float(found.x)), float(found.fun))
