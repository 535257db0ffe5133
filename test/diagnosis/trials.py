"""Structures of which only the error matters."""

from functools import cache

import numpy as np

from actuator_glue.diagnosis.learned.forms import forms
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.model.effects import CATALOGUE, Effect, Scale
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

THETA = np.array([235.0, 5.0e10, 4.23e6, 3.3])


@cache
def entries() -> dict[str, Effect]:
    """All effects and all forms of a usual test, which take a second to make."""
    offered = forms(Scale(2e-3, 0.1, 60.0, 1 / 256, 250e3, THETA))
    return dict(CATALOGUE) | {e.name: e for e in offered}


def trial(names: tuple[str, ...], rms: float) -> Trial:
    """A structure that leaves an error of this size."""
    error = rms * np.ones(10)
    return Trial(Structure(entries()[n] for n in names), '', fit_of(error, names), np.zeros(2))


def fit_of(error: Array, names: tuple[str, ...]) -> Fit:
    """A fit of Eq. (2) and of one size per effect."""
    size = 4 + len(names)
    return Fit(np.ones(size), error, np.zeros((size, len(error))), np.zeros(4))
