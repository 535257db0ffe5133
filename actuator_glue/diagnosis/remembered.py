"""What one look at a machine leaves for the next, which has more data of the same machine."""

from __future__ import annotations

from dataclasses import dataclass, field

from actuator_glue.inference.prior_use import GivenPrior
from actuator_glue.records import Array

# A move that was refused in so much of the data would be refused again.
_STILL = 0.125


@dataclass(slots=True)
class Remembered:
    """Where refits ended, and what was asked for in vain.

    Attributes:
        ended: parameters (p,) of structures by their effects.
        refused: counted samples of answers that a move was made beside and changed nothing, by
            the move and the answer's effects.
    """

    ended: dict[frozenset[str], Array] = field(default_factory=dict)
    refused: dict[tuple[str, frozenset[str]], int] = field(default_factory=dict)

    def copied(self) -> Remembered:
        """Return the same, which stays as it is."""
        return Remembered(dict(self.ended), dict(self.refused))

    def would_refuse(self, what: str, effects: frozenset[str], samples: int) -> bool:
        """Whether a move was made in vain beside the same effects, and not much more has come.

        Args:
            what: the move.
            effects: of the answer.
            samples: counted now.
        """
        return self.refused.get((what, effects), 0) >= _STILL * samples


@dataclass(frozen=True, slots=True)
class Before:
    """What was known of a machine before its records.

    Attributes:
        prior: what an earlier calibration knew of Eq. (2)'s parameters.
        remembered: what an earlier look at fewer data left; receives what this one leaves.
    """

    prior: GivenPrior | None = None
    remembered: Remembered | None = None
