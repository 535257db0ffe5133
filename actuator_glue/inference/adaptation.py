"""What the sampler tunes: all of it in burn-in; after that only what follows the archive.

Crossover probabilities and outlier handling stop with burn-in. Fits and shares of the moves are
renewed whenever the archive has doubled, that is ever more rarely, from ever more points.
"""

from __future__ import annotations

import math

import numpy as np

from actuator_glue.inference import bend, student
from actuator_glue.inference.archive import newest
from actuator_glue.inference.moves.move import UNTEMPERED, Knobs, ProposalContext, Tuning
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.transforms.log import Log
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Every crossover class keeps at least this weight, and moves without a fixed share this one, so
# that what failed early can still prove itself.
_FLOOR = 0.1
_LEAST = 0.05


def empty_counts(settings: SamplerSettings) -> Array:
    """Uses, acceptances, squared jumps of each move and crossover class: zeros (M + n_CR, 3)."""
    return np.zeros((len(settings.moves) + settings.crossovers, 3))


def tuned(points: Array, counts: Array, settings: SamplerSettings, box: Log) -> ProposalContext:
    """Return what the moves depend on, fitted to points (m, p) and to what they achieved.

    Crossover classes share in proportion to their mean squared jump (Vrugt 2016, section 3.2.1);
    moves without a fixed share divide the rest in proportion to the square of the effective draws
    that such jumps make: nearer to the better one alone than to equal parts.

    Args:
        points: the archive, in sampling coordinates.
        counts: uses, acceptances and squared jumps, as `empty_counts`.
        settings: settings of the sampler.
        box: the prior.
    """
    d, moves = points.shape[1], settings.moves
    context = ProposalContext(
        lower=box.low,
        width=box.width,
        tuning=Tuning(
            np.empty(len(moves)),
            np.empty(settings.crossovers),
            np.empty(d),
            np.empty(d),
            np.empty((d, d)),
            np.empty(d),
            np.empty(d),
        ),
        tempering=UNTEMPERED,
        fixed=np.array([-1.0 if move.share is None else move.share for move in moves]),
        most=np.array([move.most for move in moves]),
        knobs=Knobs(settings.pairs, settings.unit_jump, settings.jitter, settings.noise),
    )
    _fit(points, counts, context, True)
    return context


@njit(fastmath=False)
def _drawn(jump: float, dimension: int) -> float:
    """Effective draws per move, r/(2 - r), if its mean squared jump is 2 p r in variances."""
    r = min(0.5 * jump / dimension, 1.0)
    return r / (2.0 - r)


@njit(fastmath=False)
def _share(reach: Array, context: ProposalContext, dimension: int, cumulative: Array) -> None:
    """Write the cumulative probabilities of the moves, given their mean squared jumps (M,)."""
    total, fixed, equal, base = 0.0, 0.0, 0, -1
    for k in range(len(cumulative)):
        cumulative[k] = 0.0
        if context.fixed[k] >= 0.0:
            fixed += context.fixed[k]
        else:
            cumulative[k] = _drawn(reach[k], dimension) ** 2
            total += cumulative[k]
            equal += 1
            if base < 0:
                base = k
    given = 0.0
    for k in range(len(cumulative)):
        if context.fixed[k] < 0.0 and k != base:
            part = cumulative[k] / total if total > 0.0 else 1.0 / equal
            cumulative[k] = max(context.most[k] * part, min(_LEAST, context.most[k]))
            given += cumulative[k]
    before = 0.0
    for k in range(len(cumulative)):
        if context.fixed[k] >= 0.0:
            before += context.fixed[k]
        elif k == base:
            before += (1.0 - fixed) * max(1.0 - given, 0.0)
        else:
            before += (1.0 - fixed) * cumulative[k]
        cumulative[k] = before


@njit(fastmath=False)
def _fit(points: Array, counts: Array, context: ProposalContext, crossover: bool) -> None:
    """Fit the context's tuning in place, that of crossover classes where asked."""
    tuning = context.tuning
    moves, crossovers, scale = tuning.move_cdf, tuning.crossover_cdf, tuning.scale
    reach = np.zeros(len(counts))
    for i in range(len(counts)):
        if counts[i, 0] > 0.0:
            reach[i] = counts[i, 2] / counts[i, 0]
    _share(reach, context, points.shape[1], moves)
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
    student.fit(points, tuning.centre, tuning.factor)
    for j in range(len(scale)):
        scale[j] = 0.0
        for k in range(j + 1):
            scale[j] += tuning.factor[j, k] * tuning.factor[j, k]
        scale[j] = math.sqrt(scale[j])
    if bend.fit(points, tuning.centre, tuning.factor, tuning.along, tuning.across):
        straight = points.copy()
        for i in range(len(straight)):
            bend.shift(straight[i], tuning.centre, tuning.along, tuning.across, -1.0)
        student.fit(straight, tuning.centre, tuning.factor)


@njit(fastmath=False)
def rescue(z: Array, x: Array, values: Array, target: Array, total: Array) -> None:
    """Put outlier chains where the chain of the highest log likelihoods stands; zero `total`.

    Outliers are chains whose mean log likelihood since they were last looked at, by which `total`
    (n,) orders them, lies below Q1 - 2 IQR of all chains (Vrugt 2016, Eq. 25). The other arguments
    are a `ChainState`'s parts, changed in place.
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
    z: Array,
    x: Array,
    values: Array,
    target: Array,
    total: Array,
    rows: Array,
    size: int,
    counts: Array,
    context: ProposalContext,
    burning: bool,
    fitted: int,
) -> int:
    """Have the moves follow an archive that has grown, in place; return its size at the last fit.

    In burn-in outlier chains are rescued and everything is fitted anew; after it only when the
    archive has doubled, from what the moves achieved since, which is then forgotten.

    Args:
        z: the chains, as in a `ChainState`, (n, p).
        x: likewise, (n, p).
        values: their log likelihoods, (n,).
        target: their log targets, (n,).
        total: sum of each chain's log likelihoods since this was last done, (n,); zeroed.
        rows: the archive's buffer, (>= size, p).
        size: how much of it is filled.
        counts: uses, acceptances and squared jumps, as `empty_counts`; changed in place.
        context: of which the tuning is fitted.
        burning: whether this is burn-in.
        fitted: size of the archive at the last fit.
    """
    if not burning and size < 2 * fitted:
        return fitted
    if burning:
        rescue(z, x, values, target, total)
    _fit(newest(rows, size), counts, context, burning)
    if not burning:
        counts[:] = 0.0
    return size
