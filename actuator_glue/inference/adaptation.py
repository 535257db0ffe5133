"""What the sampler tunes during burn-in, and never afterwards."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.moves import INDEPENDENCE, NAMES, PARALLEL, independence
from actuator_glue.inference.settings import Settings
from actuator_glue.records import Array

# Every crossover class and the parallel move keep at least this share while something is tuned.
_FLOOR = 0.1


class Tuning(NamedTuple):
    """Proposal distributions of the moves.

    Attributes:
        move_cdf: cumulative probabilities of the moves, (3,).
        crossover_cdf: cumulative probabilities of the crossover classes, (n_CR,).
        scale: standard deviation of each coordinate over the archive, (p,).
        centre: centre of the independence move, (p,).
        factor: Cholesky factor of its covariance, (p, p).
    """

    move_cdf: Array
    crossover_cdf: Array
    scale: Array
    centre: Array
    factor: Array


def empty_counts(settings: Settings) -> Array:
    """Uses, acceptances and squared jumps of each move and crossover class, all zero."""
    return np.zeros((len(NAMES) + settings.crossovers, 3))


def tune(points: Array, counts: Array, settings: Settings) -> Tuning:
    """Fit the proposals to points (m, p) and the shares to what the moves achieved.

    Crossover classes get probabilities proportional to their mean squared jump (Vrugt 2016,
    section 3.2.1); the independence and parallel moves share what the snooker move leaves by the
    same measure.
    """
    reach = _mean_jumps(counts)
    crossover = reach[len(NAMES) :]
    if crossover.sum() > 0.0:
        crossover = np.maximum(crossover / crossover.sum(), _FLOOR)
    else:
        crossover = np.ones(settings.crossovers)
    both = reach[INDEPENDENCE] + reach[PARALLEL]
    share = reach[INDEPENDENCE] / both if both > 0.0 else 0.5
    share = settings.independence * share if settings.independence > 0.0 else 0.0
    free = 1.0 - settings.snooker
    moves = np.array([free * (1.0 - share), settings.snooker, free * share])
    return _fitted(points, np.cumsum(moves), np.cumsum(crossover / crossover.sum()))


def refit(points: Array, tuning: Tuning) -> Tuning:
    """Fit the proposals to points (m, p); the shares stay as they are."""
    return _fitted(points, tuning.move_cdf, tuning.crossover_cdf)


def _fitted(points: Array, move_cdf: Array, crossover_cdf: Array) -> Tuning:
    centre, factor = independence.fit(points)
    scale = np.sqrt((factor**2).sum(axis=1))
    return Tuning(move_cdf, crossover_cdf, scale, centre, factor)


def _mean_jumps(counts: Array) -> Array:
    return np.divide(
        counts[:, 2], counts[:, 0], out=np.zeros(len(counts)), where=counts[:, 0] > 0.0
    )


def outliers(mean_log_density: Array) -> NDArray[np.intp]:
    """Chains whose mean log density lies below Q1 - 2 IQR of all chains (Vrugt 2016, Eq. 25)."""
    first, third = np.quantile(mean_log_density, (0.25, 0.75))
    return np.flatnonzero(mean_log_density < first - 2.0 * (third - first))
