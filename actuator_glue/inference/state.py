"""The sampler's state between generations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.adaptation import Tuning
from actuator_glue.inference.archive import Archive
from actuator_glue.inference.settings import Settings
from actuator_glue.inference.sweep import Around, Learning, Walk
from actuator_glue.records import Array


class State(NamedTuple):
    """Everything the next generation depends on, besides the generator.

    Attributes:
        x: current points of the chains, (n, p) [physical units].
        z: the same in sampling coordinates, (n, p).
        log_density: log likelihood at x, (n,).
        log_target: log density of z, (n,) = log_density + log Jacobian.
        archive: past states Z in sampling coordinates.
        tuning: proposal distributions of the moves.
        fitted: size of the archive when they were last fitted.
        counts: uses, acceptances and squared jumps since burn-in began or the last fit.
        sum_log_density: sum of log_density since the last look at outliers, (n,).
        generation: generations since the chains started.
        evaluations: likelihood evaluations so far, annealing included.
        power: likelihood power reached by annealing; below 1 only if the budget ran out.
    """

    x: Array
    z: Array
    log_density: Array
    log_target: Array
    archive: Archive
    tuning: Tuning
    fitted: int
    counts: Array
    sum_log_density: Array
    generation: int
    evaluations: int
    power: float
    lower: Array
    width: Array
    settings: Settings

    @property
    def burn_in(self) -> int:
        """Generations of burn-in to come."""
        return max(self.settings.adaptation - self.generation, 0)

    @property
    def walk(self) -> Walk:
        """Where the chains stand."""
        return Walk(self.z, self.x, self.log_density, self.log_target)

    @property
    def around(self) -> Around:
        """What the next generation depends on besides chains and archive."""
        return Around(self.lower, self.width, self.tuning, self.settings)

    @property
    def learning(self) -> Learning:
        """What the moves learn from on the way."""
        return Learning(self.sum_log_density, self.burn_in, self.fitted)

    @property
    def until_append(self) -> int:
        """Generations until the chains next enter the archive."""
        return self.settings.thinning - self.generation % self.settings.thinning


class Info(NamedTuple):
    """What happened in one generation.

    Attributes:
        accepted: (n,) bool.
        move: index into `moves.NAMES`, (n,).
        crossover: crossover class of parallel moves, (n,); -1 for all others and for unit jumps.
    """

    accepted: NDArray[np.bool_]
    move: NDArray[np.int64]
    crossover: NDArray[np.int64]


def moved(
    state: State, walk: Walk, archive: Archive, fitted: int, counts: Array, generations: int
) -> State:
    """Return the state some generations later.

    Args:
        state: before.
        walk: where the chains stand now.
        archive: with what they have left in it.
        fitted: its size when the moves were last fitted.
        counts: with what the moves achieved.
        generations: how many.
    """
    return state._replace(
        x=walk.x,
        z=walk.z,
        log_density=walk.log_density,
        log_target=walk.log_target,
        archive=archive,
        counts=counts,
        fitted=fitted,
        generation=state.generation + generations,
        evaluations=state.evaluations + generations * len(walk.z),
    )
