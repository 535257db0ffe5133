"""What the sampler tunes: all of it in burn-in; after that only what follows the archive.

Crossover probabilities and outlier handling stop with burn-in. Fits and shares of the moves are
renewed whenever the archive has doubled, that is ever more rarely, from ever more points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.moves import INDEPENDENCE, NAMES, PARALLEL, independence
from actuator_glue.inference.settings import Settings
from actuator_glue.records import Array

# Every crossover class keeps at least this weight, and the independence move this share, so that
# what failed early can still prove itself.
_FLOOR = 0.1
_LEAST = 0.05


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


def tune(
    points: Array, counts: Array, settings: Settings, crossover_cdf: Array | None = None
) -> Tuning:
    """Fit the proposals to points (m, p) and the shares to what the moves achieved.

    The measure is the mean squared jump (Vrugt 2016, section 3.2.1): the independence and parallel
    moves share by it what the snooker move leaves, and so do the crossover classes, unless
    `crossover_cdf` says what they have.
    """
    reach = _mean_jumps(counts)
    both = reach[INDEPENDENCE] + reach[PARALLEL]
    share = settings.independence * (reach[INDEPENDENCE] / both if both > 0.0 else 0.5)
    if settings.independence > 0.0:
        share = max(share, min(_LEAST, settings.independence))
    free = 1.0 - settings.snooker
    moves = np.array([free * (1.0 - share), settings.snooker, free * share])
    if crossover_cdf is None:
        crossover = reach[len(NAMES) :]
        crossover = crossover / crossover.sum() if crossover.sum() > 0.0 else crossover
        crossover = np.maximum(crossover, _FLOOR)
        crossover_cdf = np.cumsum(crossover / crossover.sum())
    centre, factor = independence.fit(points)
    scale = np.sqrt((factor**2).sum(axis=1))
    return Tuning(np.cumsum(moves), crossover_cdf, scale, centre, factor)


def _mean_jumps(counts: Array) -> Array:
    return np.divide(
        counts[:, 2], counts[:, 0], out=np.zeros(len(counts)), where=counts[:, 0] > 0.0
    )


def outliers(mean_log_density: Array) -> NDArray[np.intp]:
    """Chains whose mean log density lies below Q1 - 2 IQR of all chains (Vrugt 2016, Eq. 25)."""
    ordered = np.sort(mean_log_density)
    # np.quantile's default, without its overhead: this is asked every few generations.
    first, third = np.interp(
        np.array([0.25, 0.75]) * (len(ordered) - 1), np.arange(len(ordered)), ordered
    )
    return np.flatnonzero(mean_log_density < first - 2.0 * (third - first))
