"""What was found: an effect with its rivals, and every effect that was tried."""

from __future__ import annotations

import math
from dataclasses import dataclass

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.json_value import Json, JsonObject, json_fields, json_value

BESIDE = ' + '  # between the names of two effects that stand for one


@dataclass(frozen=True, slots=True)
class Rival:
    """An effect in place of another, everything refitted, and how far behind the best it is.

    Attributes:
        name: the effect, or two of them together: `viscous-damping + delay`.
        nats: evidence of the best over it (0 for the best itself).
        stderr: standard error of that over the blocks [nats].
        excess: rms error it leaves beyond the best [m].
        tied: these data cannot tell it from the best.
        probability: its share of the weight among all rivals and 'none of these'.
        limit: where it is a richer form of the best, the parameter that makes it one and the far
            end of its 95 % interval, away from the value at which it reduces to the best.
    """

    name: str
    nats: float
    stderr: float
    excess: float
    tied: bool
    probability: float
    limit: tuple[str, float] | None = None

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of its effects: one, or two."""
        return tuple(self.name.split(BESIDE))

    def to_json(self) -> Json:
        """Return the JSON object of one rival."""
        limit = {'parameter': self.limit[0], 'limit': self.limit[1]} if self.limit else None
        return {**json_fields(self), 'limit': limit}


@dataclass(frozen=True, slots=True)
class Finding:
    """One effect that the records show and the model lacks.

    Attributes:
        name: best name in the catalogue.
        alternatives: names that these data cannot tell from it (without `name` itself).
        probability: of `name` among its rivals and 'none of these'; NaN for a learned term, which
            is a description and no cause, and for an effect of the measurement, which has none.
        place: where in the loop it acts.
        parameters: posterior of the effect's parameters.
        error_without: fit error of the structure without it or any rival [m].
        error_with: fit error with `name` in it [m].
        rivals: effects tried in its place, itself among them, best first; `none` is what their
            probabilities leave: nothing, or something that the catalogue does not hold.
        noise: rms of the noise that an effect of the measurement makes [m], which leaves the
            simulated motion as it is and removes no error; None for all others.
        evidence: out-of-sample log score gained, in nats of effectively independent samples.
        plausible: an interval of its sizes excludes the neutral value; where none does, its
            probability is less.
        agrees_across_windows: its leading parameter is the same in all halves of the records
            that fix it; None where fewer than two do (see diagnosis/posterior/agreement.py).
        windows: the leading parameter in each of these halves [unit of the parameter].
        records: sources of the records that alone have it; empty where all do.
        cause: catalogue effect of which a learned term is another shape, where the nearest name
            is of its group; empty for all others.
    """

    name: str
    alternatives: tuple[str, ...]
    probability: float
    place: str
    parameters: dict[str, Estimate]
    error_without: float
    error_with: float
    evidence: float
    plausible: bool = True
    agrees_across_windows: bool | None = None
    windows: tuple[float, ...] = ()
    records: tuple[str, ...] = ()
    noise: float | None = None
    rivals: tuple[Rival, ...] = ()
    cause: str = ''

    @property
    def none(self) -> float:
        """Probability that it is none of the rivals; NaN where there are none."""
        return 1.0 - sum(r.probability for r in self.rivals) if self.rivals else math.nan

    def to_json(self) -> Json:
        """Return the JSON object of one finding."""
        return {**json_fields(self), 'none_of_these': json_value(self.none)}


@dataclass(frozen=True, slots=True)
class Candidate(JsonObject):
    """One effect tried at the first turn (base + effect refitted together).

    Attributes:
        name: name in the catalogue.
        score: out-of-sample log score against Eq. (2) alone, effective nats.
        error: free-run rms error of base + effect, refitted [m].
        probability: weight among the candidates and Eq. (2) alone; NaN for measurement effects.
        stderr: standard error of the score over the blocks [nats]; NaN likewise.
    """

    name: str
    score: float
    error: float
    probability: float
    stderr: float = math.nan
