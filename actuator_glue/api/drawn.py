"""Draws of a posterior under one model, as predictions and models for others take them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.predictive import ResidualModel
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

SIZE = 200  # draws that are simulated for a band

Kind = TypeVar('Kind', bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """Draws under one model, and what it left of the records it was fitted to.

    Attributes:
        draws: shape (m, p), SI units.
        names: parameter of each column.
        units: their units.
        best: the best of them, shape (p,).
        structure: the model.
        residual: what it left; None where that is not known.
        records: the records, where they are still known.
        stiffness: specimen stiffnesses of the records [N/m].
        problems: why the posterior must not be used as it stands.
    """

    draws: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    best: Array
    structure: Structure
    residual: ResidualModel | None
    records: tuple[Record, ...]
    stiffness: tuple[float, ...]
    problems: tuple[str, ...]

    def some(self, count: int) -> Drawn:
        """Return so many of the draws, evenly spread over them."""
        return replace(self, draws=evenly(self.draws, count))


def evenly(draws: NDArray[Kind], count: int = SIZE) -> NDArray[Kind]:
    """Return some of draws (m, p), or of their numbers (m,), evenly spread over them."""
    return draws[np.linspace(0, len(draws) - 1, min(count, len(draws))).astype(np.intp)]
