"""What a live run did, for a replay to repeat it, and where the replay stands beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from actuator_glue.inference.choice import ModelChoice
from actuator_glue.online.structures import Proposal
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class Begun:
    """Where a window of a live run began: where the one before it ended.

    Attributes:
        number: of the window before.
        archive: points that it ended with, shape (m, p); None where they were not kept.
        whole: all of these points are there.
    """

    number: int
    archive: Array | None
    whole: bool


@dataclass(slots=True)
class ReplayPosition:
    """Whether a replay is in the live run's state, window after window.

    Attributes:
        exact: it is in that state, to the bit.
    """

    exact: bool = True
    _last: int | None = None

    def resumes(self, begun: Begun | None) -> bool:
        """Return whether a window must start from recorded points, not from the replay's own."""
        if begun is None or (self.exact and begun.number == self._last):
            return False
        resumes = begun.archive is not None
        self.exact = resumes and begun.whole
        return resumes

    def done(self, number: int) -> None:
        """Note the window that was computed last."""
        self._last = number


@dataclass(frozen=True, slots=True)
class Schedule:
    """What a live run did, for a replay to repeat it.

    Attributes:
        done: number of each window that gave a posterior, and evaluations of each structure, by
            the running index and the acquisition time [ns] of its first sample; all others were
            dropped.
        models: what is carried from each window number on, ascending.
        begun: where each window began, by its number, for those whose predecessor cannot be
            computed again.
        formed_ns: acquisition time of the first sample of the first window that was formed [ns],
            whether it gave a posterior or not; None for the first one of the stream.
    """

    done: Mapping[tuple[int, int], tuple[int, tuple[int, ...]]]
    models: tuple[tuple[int, ModelChoice | Proposal], ...] = ()
    begun: Mapping[int, Begun] = field(default_factory=dict)
    formed_ns: int | None = None
