"""One refitted structure and its out-of-sample score."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array


@dataclass(frozen=True)
class Trial:
    """One refitted structure.

    Attributes:
        structure: its effects stand in the catalogue's order, learned terms last.
        added: the effect that was added last.
        fit: base and effects refitted together.
        scores: out-of-sample log density of every block (B,) [nats].
        own: the model where it is not `structure` (see diagnosis/scopes/one_record.py).
    """

    structure: Structure
    added: str
    fit: Fit
    scores: Array
    own: Model | None = None

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of its effects."""
        return self.structure.effects

    @property
    def model(self) -> Model:
        """The model that simulates it."""
        return self.own or self.structure

    @property
    def mean_square(self) -> float:
        """Mean squared free-run error [m^2]."""
        return float(np.mean(self.fit.error**2))


def removed(before: Trial, after: Trial) -> float:
    """Rms error that a larger structure removes [m]."""
    return float(np.sqrt(max(0.0, before.mean_square - after.mean_square)))
