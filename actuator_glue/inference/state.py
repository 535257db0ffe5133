"""The sampler's state between steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.archive import Archive
from actuator_glue.inference.compiled import compiled
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.inference.moves.move import ProposalContext
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.steps import ChainState, Course, Learning
from actuator_glue.records import Array


class State(NamedTuple):
    """Everything the next step depends on, besides the generator.

    Attributes:
        now: where the chains stand.
        archive: past states Z in sampling coordinates.
        context: what the moves depend on, their proposal distributions among it.
        fitted: size of the archive when they were last fitted.
        counts: uses, acceptances and squared jumps since burn-in began or the last fit.
        sum_log_density: sum of log_density since the last look at outliers, (n,).
        made: steps since the chains started.
        evaluations: likelihood evaluations so far, annealing included.
        power: likelihood power reached by annealing; below 1 only if the budget ran out.
        settings: settings of the sampler.
        log_density: log likelihood (m,) of points (m, p) in physical units.
    """

    now: ChainState
    archive: Archive
    context: ProposalContext
    fitted: int
    counts: Array
    sum_log_density: Array
    made: int
    evaluations: int
    power: float
    settings: SamplerSettings
    log_density: LogDensity

    @property
    def adapting(self) -> int:
        """Steps of adaptation to come."""
        return max(self.settings.adaptation - self.made, 0)

    @property
    def course(self) -> Course:
        """What the next steps depend on besides chains and archive."""
        return Course(
            self.context,
            self.settings.moves,
            self.log_density,
            compiled(self.log_density),
            self.settings.thinning,
        )

    @property
    def learning(self) -> Learning:
        """What the moves learn from on the way."""
        return Learning(self.sum_log_density, self.adapting, self.fitted)

    @property
    def until_append(self) -> int:
        """Steps until the chains next enter the archive."""
        return self.settings.thinning - self.made % self.settings.thinning


class Info(NamedTuple):
    """What happened in one step.

    Attributes:
        accepted: (n,) bool.
        move: index into `SamplerSettings.moves`, (n,).
        crossover: crossover class of parallel moves, (n,); -1 for all others and for unit jumps.
    """

    accepted: NDArray[np.bool_]
    move: NDArray[np.int64]
    crossover: NDArray[np.int64]
