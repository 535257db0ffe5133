"""Draws of a posterior under one model, as predictions and models for others take them."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.inference.predictive import ResidualModel
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record


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
