"""The table of structures: all that were refitted, each with what it leaves of blocks left out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from actuator_glue.diagnosis.score import Scorer
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.json_value import JsonObject
from actuator_glue.model.structure import Structure


@dataclass(frozen=True, slots=True)
class Row(JsonObject):
    """One structure.

    Attributes:
        effects: beside Eq. (2); none for Eq. (2) alone.
        parameters: of the refit, by name, physical units.
        units: of these.
        error: rms error of the refit over the fitting part [m].
        left_out: rms error of all blocks of the fitting part, each under parameters refitted
            without it, by one Gauss-Newton step [m].
        chosen: whether it is the structure that is told.
    """

    effects: tuple[str, ...]
    parameters: dict[str, float]
    units: dict[str, str]
    error: float
    left_out: float
    chosen: bool


def rows(
    tried: Iterable[tuple[Structure, Fit]], scorer: Scorer, chosen: tuple[str, ...]
) -> tuple[Row, ...]:
    """Return a row for every structure that was refitted, least error left out first.

    Args:
        tried: structures with their refits.
        scorer: blocks of the fitting part.
        chosen: effects of the structure that is told.
    """
    table = [
        Row(
            effects=model.effects,
            parameters=dict(zip(model.names, map(float, fit.theta), strict=True)),
            units={p.name: p.unit for p in model.parameters},
            error=fit.rms,
            left_out=scorer.left_out_error(fit),
            chosen=set(model.effects) == set(chosen),
        )
        for model, fit in tried
    ]
    return tuple(sorted(table, key=lambda row: row.left_out))
