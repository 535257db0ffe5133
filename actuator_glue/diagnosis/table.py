"""The table of structures: all that were refitted, each with its weight."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from actuator_glue.diagnosis.score import Scorer
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.weights import TELLING, log_weight, price
from actuator_glue.json_value import JsonObject


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
        price: what it costs beside that: its parameters, and of how many it could have been
            chosen [nats].
        log_weight: logarithm of its weight beside that of the first row [nats].
        chosen: whether it is the structure that is told.
    """

    effects: tuple[str, ...]
    parameters: dict[str, float]
    units: dict[str, str]
    error: float
    left_out: float
    price: float
    log_weight: float
    chosen: bool


def rows(
    search: Search, scorer: Scorer, material: float, chosen: tuple[str, ...]
) -> tuple[Row, ...]:
    """Return a row for every structure that was refitted, greatest weight first (weights.py).

    Args:
        search: what was refitted.
        scorer: blocks of the fitting part.
        material: least rms error that matters [m].
        chosen: effects of the structure that is told.
    """
    table = []
    for model, fit in search.left_at_most(math.inf):
        left, cost = scorer.left_out_error(fit), price(model, search.entries, len(search.names))
        table.append(
            Row(
                effects=model.effects,
                parameters=dict(zip(model.names, map(float, fit.theta), strict=True)),
                units={p.name: p.unit for p in model.parameters},
                error=fit.rms,
                left_out=left,
                price=cost,
                log_weight=log_weight(left, TELLING * material, cost),
                chosen=set(model.effects) == set(chosen),
            )
        )
    most = max(row.log_weight for row in table)
    beside = (replace(row, log_weight=row.log_weight - most) for row in table)
    return tuple(sorted(beside, key=lambda row: -row.log_weight))
