"""How much structure a fit leaves, and whether a larger model is worth its parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from actuator_glue.diagnosis.refits.refits import Refits, by_score
from actuator_glue.diagnosis.score import forecast
from actuator_glue.diagnosis.score.scorer import Scorer, evidence, pooled, splits_of
from actuator_glue.diagnosis.score.weights import counted, log_weight
from actuator_glue.diagnosis.search import table
from actuator_glue.diagnosis.thresholds import (
    NATS,
    ROUGHLY,
    TELLING,
    TIE_SHARE,
    TOGETHER,
    least_material,
)
from actuator_glue.diagnosis.trial import Trial, removed
from actuator_glue.inference.least_squares.fit import Fit
from actuator_glue.records import Array


class Judge:
    """Noise, and the least error that matters, of the structures that a search has refitted.

    Attributes:
        refits: the structures.
        noise: rms of what no structure explains [m].
        first: rms structure of the residual of Eq. (2) [m].
        material: least rms error that matters [m].
        nats: evidence that any addition must have.
    """

    def __init__(self, refits: Refits) -> None:
        self.refits = refits
        self.noise = self.first = self.material = 0.0
        self.nats = NATS
        self._known: tuple[Fit, tuple[float, float]] | None = None

    def renoise(self, error_of: Trial | None = None) -> None:
        """Take the noise from the residual of a structure (first: of the base)."""
        fit = error_of.fit if error_of else self.refits.base()
        parts = splits_of(self.refits.data, fit.error)
        self.refits.scorer = scorer = Scorer.of(self.refits.data, parts)
        left, self.noise = self._apart(fit)
        self.first = self.first or left
        self.material = least_material(self.noise, self.refits.scale().stroke)
        self.refits.scorer = replace(scorer, likely=left < self.material)

    def left(self, trial: Trial) -> float:
        """Rms structure that remains in the residual of a structure [m]."""
        return self._apart(trial.fit)[0]

    def _apart(self, fit: Fit) -> tuple[float, float]:
        """Rms structure and noise of a residual [m].

        Under a command as stationary as noise, structure passes for noise: there a forecast of
        samples that were not fitted gives an upper bound of the noise.
        """
        if self._known is not None and self._known[0] is fit:
            return self._known[1]
        data, scorer = self.refits.data, self.refits.scorer
        splits = splits_of(data, fit.error)
        if any(self._stationary):
            most = forecast.noise(self._features, scorer, fit, NATS)
            splits = [
                replace(s, noise=min(s.noise, limit)) if asked else s
                for s, limit, asked in zip(splits, most, self._stationary, strict=True)
            ]
        self._known = fit, pooled(data, splits)
        return self._known[1]

    @cached_property
    def _features(self) -> forecast.Features:
        return forecast.Features(self.refits.data, self.refits.scale().theta)

    @cached_property
    def _stationary(self) -> list[bool]:
        return forecast.stationary(self.refits.data)

    def rescored(self, trials: Sequence[Trial]) -> list[Trial]:
        """Score with the present noise, best first."""
        return sorted((self.refits.trial(t.effects, t.added) for t in trials), key=by_score)

    def better(self, larger: Trial, smaller: Trial, threshold: float, cost: float = 0.0) -> bool:
        """Whether the larger structure is worth its parameters: significant and material.

        Args:
            larger: the structure that adds something.
            smaller: the structure without it.
            threshold: least rms error to be removed [m].
            cost: nats to be gained beyond those of any addition.
        """
        extra = len(larger.fit.theta) - len(smaller.fit.theta)
        nats = evidence(larger.scores, smaller.scores) - extra - cost
        return removed(smaller, larger) >= threshold and nats >= self.nats

    def behind(self, trial: Trial, other: Trial, alike: float = 0.0) -> float:
        """Return by how many nats a structure's weight is below another's (see weights.py).

        Args:
            trial: the structure.
            other: the one that it is compared with.
            alike: rms error that costs a nat between equations for the same thing, in addition
                (as squares) to `TELLING` of what matters [m].
        """
        tells = math.hypot(TELLING * self.material, alike)
        return self._log_weight(other, tells) - self._log_weight(trial, tells)

    def _log_weight(self, trial: Trial, tells: float) -> float:
        left_out = self.refits.scorer.left_out_error(trial.fit)
        left_out = counted(left_out, trial.effects, self.material)
        return log_weight(left_out, tells, self.refits.price(trial.structure))

    def heaviest(self, trials: Sequence[Trial]) -> Trial:
        """Return the structure of the greatest weight."""
        refits = self.refits
        rows = [
            table.row(t.structure, t.effects, t.fit, refits.scorer, refits.price(t.structure))
            for t in trials
        ]
        nearest = min(trials, key=lambda t: t.fit.rms)
        return trials[self._heaviest(rows, nearest)]

    def heaviest_known(self, told: Trial) -> Trial:
        """Return the structure of the greatest weight of all that were refitted.

        Args:
            told: the reported one, returned where no other has more weight.
        """
        rows = table.rows(self.refits, self.refits.scorer)
        best = rows[self._heaviest(rows, told, self.nearest_known())].effects
        return told if set(best) == set(told.effects) else self.refits.trial(best)

    def _heaviest(self, rows: Sequence[table.Row], *near: Trial) -> int:
        """Return the place of the row of the greatest weight.

        Args:
            rows: structures.
            near: those that may leave nothing that matters, likelier ones first.
        """
        complete = any(self.left(trial) < self.material for trial in near)
        return int(np.argmax(table.weights(rows, self.material, complete)))

    def nearest_known(self) -> Trial:
        """Return the structure of the least error of all that were refitted."""
        known = self.refits.left_at_most(math.inf)
        return self.refits.trial(min(known, key=lambda pair: pair[1].rms)[0].effects)

    def odds(self, rest: Trial, best: Trial, trials: Sequence[Trial]) -> list[float]:
        """Return the weights of an effect's rivals, and of no effect, relative to its own.

        Equations for the same thing are told apart less sharply, the more they explain: none of
        them is exactly the machine's.

        Args:
            rest: the structure without the effect.
            best: with it.
            trials: with another in its place.
        """
        alike = TIE_SHARE * removed(rest, best)
        behind = [*(self.behind(t, best, alike) for t in trials), self.behind(rest, best)]
        return [math.exp(-max(b, 0.0)) for b in behind]

    def shares(self, trials: Sequence[Trial]) -> Array:
        """Return the share that each of some structures has of their weight (K,)."""
        behind = np.array([self.behind(t, trials[0]) for t in trials])
        weights = np.exp(behind.min() - behind)
        return np.asarray(weights / weights.sum())

    def may_matter_below(self, current: Trial) -> float:
        """Mean squared error below which a rough refit may come to matter [m^2]."""
        return current.mean_square - (ROUGHLY * self.material) ** 2

    def part(self) -> float:
        """Error that each of two effects must remove if they matter only together [m]."""
        return TOGETHER * self.material

    def least(self, larger: Trial, smaller: Trial) -> float:
        """Error that a member must remove [m]: less where it makes the rest immaterial."""
        completes = self.left(larger) < self.material <= self.left(smaller)
        return self.part() if completes else self.material
