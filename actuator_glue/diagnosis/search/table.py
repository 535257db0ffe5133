"""The table of structures: all that a diagnosis refitted, in every scope, each with its weight.

A scope is what a structure holds for, where that is not all records as they were given: one record
alone, the data since a moment, a command that runs linearly. A structure with a scope is a row
like any other: its error counts over all data, and the choice of the scope has a price.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.diagnosis.score.weights import counted, log_weights
from actuator_glue.diagnosis.thresholds import MATTERING, TELLING
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.json_value import JsonObject
from actuator_glue.records import Array

LINEAR = 'command linear between samples'
SINCE = 'since '


@dataclass(frozen=True, slots=True)
class Row(JsonObject):
    """One structure.

    Attributes:
        effects: beside Eq. (2); none for Eq. (2) alone.
        scope: what it holds for; empty for all records as they were given.
        parameters: of the refit, by name, physical units.
        units: of these.
        error: rms error of the refit over the fitting part [m].
        left_out: rms error of all blocks of the fitting part, each under parameters refitted
            without it, by one Gauss-Newton step [m].
        price: its cost besides that error: its parameters, and the number of structures it could
            have been chosen from [nats].
        log_weight: logarithm of its weight beside that of the first row [nats].
        chosen: whether it is the reported structure.
    """

    effects: tuple[str, ...]
    scope: str
    parameters: dict[str, float]
    units: dict[str, str]
    error: float
    left_out: float
    price: float
    log_weight: float = math.nan
    chosen: bool = False

    @property
    def key(self) -> tuple[str, frozenset[str]]:
        """Scope and effects, which no other row of a table has."""
        return self.scope, frozenset(self.effects)


def additions(effects: Sequence[str], scope: str = '') -> int:
    """Return how much a structure adds to Eq. (2) as given: effects, the other hold, an onset.

    One record's own setting is one of the effects.
    """
    rest = scope.removeprefix(LINEAR).removeprefix(', ')
    return len(effects) + scope.startswith(LINEAR) + rest.startswith(SINCE)


def rows(refits: Refits, scorer: Scorer) -> tuple[Row, ...]:
    """Return a row for every structure that a search refitted; none has a weight yet.

    Args:
        refits: what was refitted.
        scorer: blocks of the fitting part.
    """
    return tuple(
        row(model, model.effects, fit, scorer, refits.price(model))
        for model, fit in refits.left_at_most(math.inf)
    )


def row(
    model: Model, effects: tuple[str, ...], fit: Fit, scorer: Scorer, cost: float, scope: str = ''
) -> Row:
    """Return the row of one structure.

    Args:
        model: what simulates it.
        effects: beside Eq. (2).
        fit: its refit.
        scorer: blocks of the fitting part.
        cost: its price [nats].
        scope: what it holds for.
    """
    values = zip(model.parameters, map(float, fit.theta), strict=True)
    units = {p.name: p.unit for p in model.parameters}
    parameters = {p.name: value for p, value in values}
    left_out = scorer.left_out_error(fit)
    return Row(effects, scope, parameters, units, fit.rms, left_out, cost)


def of_hold(refits: Refits) -> float:
    """Return the price of another hold [nats]: it is one more candidate."""
    return math.log(1 + len(refits.names))


def scoped(some: Iterable[Row], scope: str, cost: float) -> tuple[Row, ...]:
    """Return rows in a further scope, whose choice costs `cost` nats."""
    return tuple(
        replace(r, scope=', '.join(filter(None, (scope, r.scope))), price=r.price + cost)
        for r in some
    )


def since(some: Iterable[Row], before: Fit, samples: int) -> tuple[Row, ...]:
    """Return rows of the data since a moment as rows of all data.

    Args:
        some: rows of the data since then.
        before: what holds before the moment, with parameters of its own.
        samples: that count since then.
    """
    early = before.error.size / (before.error.size + samples)

    def all_(late: float) -> float:
        return math.sqrt(early * before.rms**2 + (1.0 - early) * late**2)

    return tuple(replace(r, error=all_(r.error), left_out=all_(r.left_out)) for r in some)


def weighed(
    some: Iterable[Row],
    material: float,
    effects: tuple[str, ...],
    scope: str,
    complete: bool = True,
) -> tuple[Row, ...]:
    """Return rows with their weights, greatest first (weights.py); of equal ones the better fit.

    Args:
        some: rows of all searches.
        material: least rms error that matters [m].
        effects: of the reported structure.
        scope: of the reported structure.
        complete: whether the reported structure leaves nothing that matters.
    """
    best: dict[tuple[str, frozenset[str]], Row] = {}
    for r in sorted(some, key=lambda r: r.left_out):
        best.setdefault(r.key, r)
    told = scope, frozenset(effects)
    found = [
        replace(r, chosen=key == told, log_weight=float(weight))
        for (key, r), weight in zip(
            best.items(), weights(list(best.values()), material, complete), strict=True
        )
    ]
    return tuple(sorted(found, key=lambda r: -r.log_weight))


def outweighs(other: Row, told: Row, material: float, complete: bool) -> bool:
    """Whether another row has more weight than the one told.

    Args:
        other: the other row.
        told: the one that is told.
        material: least rms error that matters [m].
        complete: whether either leaves nothing that matters.
    """
    first, second = weights([told, other], material, complete)
    return bool(second > first)


def weights(some: Sequence[Row], material: float, complete: bool = True) -> Array:
    """Return the logarithms of the weights of rows (K,), the greatest 0 [nats].

    Args:
        some: the rows.
        material: least rms error that matters [m].
        complete: whether any leaves nothing that matters; while none does all are wrong, and a
            small difference tells nothing of them.
    """
    telling = TELLING if complete else MATTERING
    errors = [counted(r.left_out, r.effects, material) for r in some]
    counts = [additions(r.effects, r.scope) for r in some]
    return log_weights(errors, [r.price for r in some], counts, material, telling)
