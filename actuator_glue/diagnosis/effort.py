"""The effort of a search: how much it may simulate before it reports what is known by then."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from actuator_glue.diagnosis.remembered import Remembered
from actuator_glue.inference.least_squares.fit import Fit

# Share of the effort by which a search in another scope (another hold, the data since a moment)
# may exceed it: begun late, it would end with its largest effect alone.
_EXTENSION = 0.5


@dataclass(frozen=True)
class Effort:
    """Work of all refits of a diagnosis, shared by every search that it makes.

    Counted in sub-steps of the kernels, not in seconds: the same records give the same answer on
    every machine. A core takes one to three millions of them in a second.

    Attributes:
        most: sub-steps after which no further search is begun.
        earlier: results of an earlier diagnosis of the same machine, which save work.
        remembered: results of this one for the next.
        beyond: share of `most` by which the search may exceed it.
        tell: called between refits, from the thread that asked for the diagnosis.
    """

    most: float = math.inf
    earlier: Remembered = field(default_factory=Remembered)
    remembered: Remembered = field(default_factory=Remembered)
    beyond: float = 0.0
    tell: Callable[[], None] = lambda: None
    _refits: list[int] = field(default_factory=list)
    _missing: list[bool] = field(default_factory=list)

    def spent_on(self, found: Fit) -> Fit:
        """Count the work of a refit, from any thread; return the refit."""
        self._refits.append(found.work)
        return found

    def expects(self, missing: bool) -> None:
        """Take down whether a search begins with something missing."""
        self._missing.append(missing)

    @property
    def missing(self) -> bool | None:
        """Whether any of its searches began with something missing; None before the first."""
        return any(self._missing) if self._missing else None

    def extended(self) -> Effort:
        """Return the same effort for a search that begins late, which may go beyond it."""
        return replace(self, beyond=_EXTENSION)

    @property
    def spent(self) -> int:
        """Sub-steps so far."""
        return sum(self._refits)

    @property
    def share(self) -> float:
        """Share of the effort spent; above one where the last refits exceeded it."""
        return self.spent / self.most

    @property
    def over(self) -> bool:
        """Whether the effort is spent, so that no further step of a search is begun."""
        return self.spent >= (1.0 + self.beyond) * self.most
