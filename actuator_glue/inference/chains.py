"""What a run of the sampler leaves: draws and what can be said about them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from actuator_glue.inference.convergence import rhat_and_ess
from actuator_glue.records import Array

# Points handed to the next run: enough for a covariance of any model here, light enough to pickle.
_ARCHIVE = 1000


@dataclass(frozen=True)
class Chains:
    """Draws of all chains in the order they were made.

    Attributes:
        draws: (steps, chains, p) [physical units], burn-in included.
        log_density: log likelihood of each draw, (steps, chains).
        evaluations: likelihood evaluations of the whole run, the start included.
        start_evaluations: evaluations before the first step.
        burn: first steps, the adaptation among them; not draws of the posterior.
        annealed: False if the budget ended before the start had reached the posterior.
    """

    draws: Array
    log_density: Array
    evaluations: int
    start_evaluations: int
    burn: int
    annealed: bool = True

    @property
    def kept(self) -> Array:
        """Draws after burn-in, (steps - burn, chains, p)."""
        return self.draws[self.burn :]

    def posterior(self) -> Array:
        """Draws (m, p) of all chains after burn-in."""
        return self.kept.reshape(-1, self.draws.shape[2])

    @cached_property
    def _diagnostics(self) -> tuple[Array, Array]:
        return rhat_and_ess(self.kept)

    @property
    def rhat(self) -> Array:
        """Rank-normalised split R-hat of each parameter after burn-in, (p,)."""
        return self._diagnostics[0]

    @property
    def ess(self) -> Array:
        """Bulk effective sample size of each parameter after burn-in, (p,)."""
        return self._diagnostics[1]

    @cached_property
    def best(self) -> Array:
        """Point (p,) of the largest log likelihood visited."""
        at = int(self.log_density.argmax())
        flat = self.draws.reshape(-1, self.draws.shape[2])
        return np.asarray(flat[at])

    @property
    def archive(self) -> Array:
        """At most 1000 points (m, p) spread over the posterior draws, for a warm start."""
        points = self.posterior()
        chosen = np.linspace(0, len(points) - 1, min(_ARCHIVE, len(points))).astype(np.intp)
        return np.asarray(points[chosen])
