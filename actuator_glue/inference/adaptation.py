"""What the sampler tunes: all of it in burn-in; after that only what follows the archive.

Crossover probabilities and outlier handling stop with burn-in. Fits and shares of the moves are
renewed whenever the archive has doubled, that is ever more rarely, from ever more points.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from actuator_glue.inference.archive import newest
from actuator_glue.inference.moves import INDEPENDENCE, NAMES, PARALLEL, independence
from actuator_glue.inference.settings import Settings
from actuator_glue.jit import njit
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


def tune(points: Array, counts: Array, settings: Settings) -> Tuning:
    """Fit the proposals to points (m, p) and the shares to what the moves achieved.

    Crossover classes share by their mean squared jump (Vrugt 2016, section 3.2.1); the
    independence and parallel moves share what the snooker move leaves by the square of the
    effective draws that such jumps make: nearer to the better one alone than to equal parts.
    """
    dimension = points.shape[1]
    new = Tuning(
        np.empty(len(NAMES)), np.empty(settings.crossovers), np.empty(dimension),
        np.empty(dimension), np.empty((dimension, dimension)),
    )  # fmt: skip
    _fit(points, counts, settings.independence, settings.snooker, True, new)
    return new


@njit(fastmath=False)
def _drawn(jump: float, dimension: int) -> float:
    """Effective draws per move whose mean squared jump is 2 p r, in standard deviations."""
    r = min(0.5 * jump / dimension, 1.0)
    return r / (2.0 - r)


@njit(fastmath=False)
def _fit(
    points: Array, counts: Array, most: float, snooker: float, crossover: bool, tuning: Tuning
) -> None:
    """Do `tune` in place, for crossover classes where asked.

    `most` and `snooker` are the settings' shares of moves.
    """
    moves, crossovers, scale = tuning.move_cdf, tuning.crossover_cdf, tuning.scale
    reach = np.zeros(len(counts))
    for i in range(len(counts)):
        if counts[i, 0] > 0.0:
            reach[i] = counts[i, 2] / counts[i, 0]
    alone = _drawn(reach[INDEPENDENCE], points.shape[1]) ** 2
    along = _drawn(reach[PARALLEL], points.shape[1]) ** 2
    share = most * (alone / (alone + along) if alone + along > 0.0 else 0.5)
    if most > 0.0:
        share = max(share, min(_LEAST, most))
    free = 1.0 - snooker
    moves[0] = free * (1.0 - share)
    moves[1] = moves[0] + snooker
    moves[2] = moves[1] + free * share
    if crossover:
        first = len(moves)
        total = 0.0
        for i in range(len(crossovers)):
            total += reach[first + i]
        weights = 0.0
        for i in range(len(crossovers)):
            weight = reach[first + i] / total if total > 0.0 else 0.0
            weights += max(weight, _FLOOR)
            crossovers[i] = weights
        for i in range(len(crossovers)):
            crossovers[i] /= weights
    independence.fit(points, tuning.centre, tuning.factor)
    for j in range(len(scale)):
        scale[j] = 0.0
        for k in range(j + 1):
            scale[j] += tuning.factor[j, k] * tuning.factor[j, k]
        scale[j] = math.sqrt(scale[j])


@njit(fastmath=False)
def rescue(z: Array, x: Array, values: Array, target: Array, total: Array) -> None:
    """Put outlier chains where the chain of the highest log likelihoods stands; zero `total`.

    Outliers are chains whose mean log likelihood since they were last looked at, by which `total`
    (n,) orders them, lies below Q1 - 2 IQR of all chains (Vrugt 2016, Eq. 25). The other arguments
    are a `Walk`'s parts, changed in place.
    """
    ordered = np.sort(total)
    quartile = np.empty(2)
    for i in range(2):  # interpolated as np.quantile does by default
        place = (0.25 + 0.5 * i) * (len(ordered) - 1)
        below = min(int(place), len(ordered) - 2)
        quartile[i] = ordered[below] + (place - below) * (ordered[below + 1] - ordered[below])
    least, best = quartile[0] - 2.0 * (quartile[1] - quartile[0]), np.argmax(total)
    for i in range(len(total)):
        if total[i] < least:
            z[i], x[i] = z[best], x[best]
            values[i], target[i] = values[best], target[best]
    total[:] = 0.0


@njit(fastmath=False)
def learn(
    z: Array, x: Array, values: Array, target: Array, total: Array, rows: Array, size: int,
    counts: Array, most: float, snooker: float, tuning: Tuning, burning: bool, fitted: int,
) -> int:  # fmt: skip
    """Have the moves follow an archive that has grown, in place; return its size at the last fit.

    In burn-in outlier chains are rescued and everything is fitted anew; after it only when the
    archive has doubled, from what the moves achieved since, which is then forgotten.

    Args:
        z: the chains, as in a `Walk`, (n, p).
        x: likewise, (n, p).
        values: their log likelihoods, (n,).
        target: their log targets, (n,).
        total: sum of each chain's log likelihoods since this was last done, (n,); zeroed.
        rows: the archive's buffer.
        size: how much of it is filled.
        counts: uses, acceptances and squared jumps of the moves.
        most: the settings' largest share of independence moves.
        snooker: the settings' share of snooker moves.
        tuning: what is fitted.
        burning: whether this is burn-in.
        fitted: size of the archive at the last fit.
    """
    if not burning and size < 2 * fitted:
        return fitted
    if burning:
        rescue(z, x, values, target, total)
    _fit(newest(rows, size), counts, most, snooker, burning, tuning)
    if not burning:
        counts[:] = 0.0
    return size
