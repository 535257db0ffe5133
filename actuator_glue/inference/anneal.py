"""From the prior, or from an earlier posterior, to the posterior by tempering.

The targets are pi_b(z) = r(z)^(1-b) p(z)^b with r the reference the points start from, p the
posterior and b rising from 0 to 1 by steps that keep a set share of the points alive:
sequential Monte Carlo (Del Moral, Doucet and Jasra 2006) in the form that keeps every state of
every chain (Dau and Chopin 2022), with the sampler's own moves. It only chooses where chains start
and what the first archive holds; nothing of it enters the posterior draws.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference import metropolis, student
from actuator_glue.inference.adaptation import empty_counts, tuned
from actuator_glue.inference.archive import Archive
from actuator_glue.inference.compiled import compiled
from actuator_glue.inference.evaluate import LogDensity, check_values, evaluate
from actuator_glue.inference.moves.move import UNTEMPERED, Tempering, uniforms_per_chain
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.steps import ChainState, Course, many
from actuator_glue.inference.transforms.log import Log
from actuator_glue.jit import njit
from actuator_glue.records import Array

# A rise of the power, with too few distinct starts of chains, that shows a collapse. For a normal
# posterior the power rises at most sixfold from one temperature to the next; for 80 narrow ones of
# displacement and force it doubled at most, and distinct starts were 18 % of the chains at least.
_LEAP, _DISTINCT = 20.0, 0.25


class Reference(NamedTuple):
    """Where annealing starts: points z (m, p) and what they are drawn from.

    Centre (p,) and Cholesky factor (p, p) of a Student t; empty for the prior.
    """

    points: Array
    centre: Array
    factor: Array


class Points(NamedTuple):
    """Points z (m, p), x (m, p) with their log density (m,)."""

    z: Array
    x: Array
    log_density: Array


class Population(NamedTuple):
    """What annealing leaves.

    Attributes:
        points: at the last temperature reached.
        before: at the temperature before, or of the reference: spread wider than the posterior.
        counts: what the moves achieved at the last temperature.
        power: the last one reached.
        evaluations: how many were made.
        collapsed: whether it was given up, as one point had taken the others' places.
    """

    points: Points
    before: Points
    counts: Array
    power: float
    evaluations: int
    collapsed: bool = False


def prior_reference(rng: np.random.Generator, size: int, box: Log) -> Reference:
    """Latin hypercube of the uniform prior, whose density in z is the Jacobian |dx/dz|."""
    share = (np.arange(size)[:, None] + rng.random((size, len(box.low)))) / size
    x = box.low + box.width * rng.permuted(share, axis=0)
    return Reference(box.forward(x), UNTEMPERED.centre, UNTEMPERED.factor)


def archive_reference(rng: np.random.Generator, size: int, archive: Array, box: Log) -> Reference:
    """Student t fitted to an earlier posterior z (m, p), half as wide again.

    Points beyond a bound are replaced by points of the archive: they only start the search.
    """
    dimension = archive.shape[1]
    centre, factor = np.empty(dimension), np.empty((dimension, dimension))
    student.fit(archive, centre, factor)
    factor *= 1.5
    points = student.draw_all(rng.random((size, dimension + 4)), centre, factor)
    outside = np.isneginf(box.inverse(points)[1])
    if outside.any():
        points[outside] = archive[rng.integers(0, len(archive), int(outside.sum()))]
    return Reference(points, centre, factor)


def anneal(
    rng: np.random.Generator,
    log_density: LogDensity,
    box: Log,
    reference: Reference,
    settings: SamplerSettings,
    limit: int | None = None,
    last: bool = True,
) -> Population:
    """Carry the reference's points to the posterior within `limit` evaluations.

    One point in a narrow peak from which no move leads may take the places of all others; the
    weights are even then, and the next temperature seems to be the last one.

    Args:
        rng: the only source of randomness.
        log_density: log likelihood (m,) of points (m, p) in physical units.
        box: bounds.
        reference: where the points start.
        settings: see `SamplerSettings`.
        limit: evaluations at most.
        last: whether to go on with such a population.

    Raises:
        InputError: the log density is finite at no point of the reference, or plus infinity.
    """
    z = reference.points
    size, dimension = z.shape
    x, log_jacobian = box.inverse(z)
    values = evaluate(log_density, x)
    check_values(values, x)
    evaluations = size
    power = 0.0
    before = Points(z, x, values)
    counts = empty_counts(settings)
    density = compiled(log_density)
    chains = max(size // settings.steps, 2)
    columns = uniforms_per_chain(settings.moves, dimension, settings.pairs)
    most = math.inf if limit is None else limit
    start, target = np.empty(chains, np.intp), np.empty(chains)
    while power < 1.0 and evaluations + chains * settings.steps <= most:
        before, cooler = Points(z, x, values), power
        chosen = np.empty(len(z), np.intp)
        power = _reweigh(
            z,
            values,
            log_jacobian,
            reference.centre,
            reference.factor,
            power,
            settings.survivors,
            rng.random(2),
            chosen,
            start,
            target,
        )
        leap = 0.0 < _LEAP * cooler < power and not last
        if leap and len(np.unique(z[start, 0])) < _DISTINCT * chains:
            return Population(before, before, counts, cooler, evaluations, collapsed=True)
        archive = Archive.of(z[chosen])
        tempering = Tempering(power, reference.centre, reference.factor)
        context = tuned(archive.rows, counts, settings, box)._replace(tempering=tempering)
        now = ChainState(z[start], x[start], values[start], target)
        counts = empty_counts(settings)
        uniforms = rng.random((settings.steps, chains, columns))
        course = Course(context, settings.moves, log_density, density)
        _, _, _, path = many(uniforms, now, archive, course, counts)
        evaluations += chains * settings.steps
        # Chain by chain: systematic resampling then treats every chain alike, so that modes which
        # no move connects keep their shares from temperature to temperature.
        z = path.z.swapaxes(0, 1).reshape(-1, dimension)
        x, log_jacobian = box.inverse(z)
        values = path.log_density.swapaxes(0, 1).reshape(-1)
    return Population(Points(z, x, values), before, counts, power, evaluations)


# Strict floating point: not-a-number and minus infinity are asked for.
@njit(fastmath=False)
def _reweigh(
    z: Array,
    values: Array,
    log_jacobian: Array,
    centre: Array,
    factor: Array,
    power: float,
    survivors: float,
    places: Array,
    chosen: NDArray[np.intp],
    start: NDArray[np.intp],
    target: Array,
) -> float:
    """Return the next power; resample the points z (m, p) by the weights that it implies.

    Args:
        z: points, (m, p).
        values: their log likelihoods, (m,).
        log_jacobian: ln |dx/dz| there, (m,).
        centre: see `Reference`.
        factor: see `Reference`.
        power: the one reached.
        survivors: effective share of the points to be kept.
        places: two uniforms, for the two resamplings.
        chosen: receives indices of points, (m,).
        start: receives indices for as many chains, (n,).
        target: receives their log targets at the next power, (n,).
    """
    reference, gain = np.empty(len(z)), np.empty(len(z))
    metropolis.refer(z, log_jacobian, Tempering(power, centre, factor), reference)
    finite, largest = 0, -np.inf
    for i in range(len(z)):
        gain[i] = values[i] + log_jacobian[i] - reference[i]
        if math.isfinite(gain[i]):
            largest = max(largest, gain[i])
            finite += 1
        else:
            gain[i] = -np.inf
    for i in range(len(z)):
        gain[i] -= largest
    rise = _rise(gain, 1.0 - power, survivors * finite)
    after = 1.0 if rise >= 1.0 - power else power + rise
    for i in range(len(z)):
        gain[i] *= rise
    _systematic(gain, places[0], chosen)
    _systematic(gain, places[1], start)
    metropolis.temper(values[start], log_jacobian[start], reference[start], after, target)
    return after


@njit(fastmath=False)
def _rise(gain: Array, most: float, survivors: float) -> float:
    """Return the largest rise, up to `most`, that leaves so many effective points.

    gain (m,) is zero at its largest; points whose gain is minus infinity have no weight.
    """
    low, high, middle = 0.0, most, most
    # Bisection on the logarithm first: rises span many decades.
    for _ in range(60):
        total = squares = 0.0
        for value in gain:
            weight = math.exp(middle * value)
            total += weight
            squares += weight * weight
        if total * total >= survivors * squares:
            low = middle
        else:
            high = middle
        if low == most or (low > 0.0 and high / low < 1.001):
            break
        middle = math.sqrt(low * high) if low > 0.0 else high * 1e-3
    return low if low > 0.0 else high


def resample(rng: np.random.Generator, log_weights: Array, size: int) -> NDArray[np.intp]:
    """Systematic resampling: `size` indices drawn with the given log weights, at most 0."""
    chosen = np.empty(size, np.intp)
    _systematic(log_weights, rng.random(), chosen)
    return chosen


@njit(fastmath=False)
def _systematic(log_weights: Array, first: float, chosen: NDArray[np.intp]) -> None:
    total, size = 0.0, len(chosen)
    weights = np.exp(log_weights)
    for weight in weights:
        total += weight
    at, reached = 0, weights[0]
    for i in range(size):
        place = (i + first) / size * total
        while reached < place and at < len(weights) - 1:
            at += 1
            reached += weights[at]
        chosen[i] = at
