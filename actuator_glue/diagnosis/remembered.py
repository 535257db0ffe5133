"""Results that one diagnosis keeps for the next, which has more data of the same machine."""

from __future__ import annotations

from dataclasses import dataclass, field

from actuator_glue.diagnosis.thresholds import STILL_REFUSED
from actuator_glue.inference.prior_use import GivenPrior
from actuator_glue.records import Array


@dataclass(slots=True)
class Remembered:
    """Where refits ended, and which moves were tried in vain.

    Attributes:
        ended: parameters (p,) of structures by their effects.
        refused: counted samples of answers on which a move was tried in vain, by the move and the
            answer's effects.
    """

    ended: dict[frozenset[str], Array] = field(default_factory=dict)
    refused: dict[tuple[str, frozenset[str]], int] = field(default_factory=dict)

    def copied(self) -> Remembered:
        """Return an independent copy."""
        return Remembered(dict(self.ended), dict(self.refused))

    def would_refuse(self, what: str, effects: frozenset[str], samples: int) -> bool:
        """Whether a move was tried in vain on the same effects with enough of the present data.

        Args:
            what: the move.
            effects: of the answer.
            samples: counted now.
        """
        return self.refused.get((what, effects), 0) >= STILL_REFUSED * samples


@dataclass(frozen=True, slots=True)
class Before:
    """What was known of a machine before its records.

    Attributes:
        prior: what an earlier calibration knew of Eq. (2)'s parameters.
        remembered: results of an earlier diagnosis of fewer data; receives those of this one.
    """

    prior: GivenPrior | None = None
    remembered: Remembered | None = None
