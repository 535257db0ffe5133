"""How an answer was found: which step led to which structure, in order."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.diagnosis.trial import Trial
from actuator_glue.json_value import JsonObject


@dataclass(frozen=True, slots=True)
class SearchStep(JsonObject):
    """One step of a search that was taken.

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
