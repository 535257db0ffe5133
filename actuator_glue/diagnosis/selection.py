"""The result of a search for the missing effects, on the fitting part of the records."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.diagnosis.finding import Rival
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.json_value import JsonObject


@dataclass(frozen=True, slots=True)
class SearchStep(JsonObject):
    """One step that a search took.

    Attributes:
        what: what was done, for people.
        effects: of the structure that it led to.
        parameters: how many that has, Eq. (2)'s among them.
        error: rms error that it leaves in the fitting part, noise included [m].
    """

    what: str
    effects: tuple[str, ...]
    parameters: int
    error: float

    @classmethod
    def to(cls, trial: Trial, what: str) -> SearchStep:
        """Return the step to a structure."""
        return cls(what, trial.effects, len(trial.fit.theta), trial.fit.rms)


@dataclass(frozen=True)
class Selection:
    """Result of a search on the fitting part.

    Attributes:
        base: Eq. (2) refitted.
        singles: every single effect refitted, best first.
        final: the structure chosen.
        rivals: per effect of `final`, the effects tried in its place, best first.
        removed: per effect of `final`, rms error it removes given the others [m].
        evidence: per effect of `final`, nats it gains given the others.
        structure: rms structure of the base residual [m].
        left: rms structure of the final residual [m].
        noise: rms of what no structure explains [m].
        material: materiality threshold [m].
        nats: evidence that any addition must have.
        steps: of the search that added one effect at a time; none where something else led here.
        described: whether that search ended because one learned term leaves nothing material.
    """

    base: Trial
    singles: tuple[Trial, ...]
    final: Trial
    rivals: dict[str, tuple[Rival, ...]]
    removed: dict[str, float]
    evidence: dict[str, float]
    structure: float
    left: float
    noise: float
    material: float
    nats: float
    steps: tuple[SearchStep, ...] = ()
    described: bool = False
