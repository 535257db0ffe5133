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

from actuator_glue.inference.adaptation import empty_counts, tune
from actuator_glue.inference.archive import Archive
from actuator_glue.inference.compiled import compiled
from actuator_glue.inference.coordinates import physical_all, sampling
from actuator_glue.inference.evaluate import LogDensity, check_values, evaluate
from actuator_glue.inference.generation import UNTEMPERED, Tempering, refer, temper
from actuator_glue.inference.moves import independence, uniforms_per_chain
from actuator_glue.inference.settings import Settings
from actuator_glue.inference.sweep import Around, Walk, many
from actuator_glue.jit import njit
from actuator_glue.records import Array


class Reference(NamedTuple):
    """Where annealing starts: points z (m, p) and what they are drawn from.

    Centre (p,) and Cholesky factor (p, p) of a Student t; empty for the prior.
    """

    points: Array
    centre: Array
    factor: Array


class Population(NamedTuple):
    """Points z (m, p), x (m, p) with their log density (m,) at the last temperature reached."""

    z: Array
    x: Array
    log_density: Array
    counts: Array
    power: float
    evaluations: int


def prior_reference(rng: np.random.Generator, size: int, lower: Array, width: Array) -> Reference:
    """Latin hypercube of the uniform prior: its density in z is the Jacobian itself."""
    share = (np.arange(size)[:, None] + rng.random((size, len(lower)))) / size
    x = lower + width * rng.permuted(share, axis=0)
    return Reference(sampling(x, lower, width), UNTEMPERED.centre, UNTEMPERED.factor)


def archive_reference(
    rng: np.random.Generator, size: int, archive: Array, lower: Array, width: Array
) -> Reference:
    """Student t fitted to an earlier posterior z (m, p), half as wide again.

    Points beyond a bound are replaced by points of the archive: they only start the search.
    """
    dimension = archive.shape[1]
    centre, factor = np.empty(dimension), np.empty((dimension, dimension))
    independence.fit(archive, centre, factor)
    factor *= 1.5
    points = independence.draw_all(rng.random((size, dimension + 5)), centre, factor)
    outside = np.isneginf(physical_all(points, lower, width)[1])
    points[outside] = archive[rng.integers(0, len(archive), int(outside.sum()))]
    return Reference(points, centre, factor)


def anneal(
    rng: np.random.Generator,
    log_density: LogDensity,
    lower: Array,
    width: Array,
    reference: Reference,
    settings: Settings,
    limit: int | None = None,
) -> Population:
    """Carry the reference's points to the posterior within `limit` evaluations.

    Raises:
        InputError: the log density is finite at no point of the reference, or plus infinity.
    """
    z = reference.points
    size, dimension = z.shape
    x, log_jacobian = physical_all(z, lower, width)
    values = evaluate(log_density, x)
    check_values(values, x)
    evaluations = size
    power = 0.0
    counts = empty_counts(settings)
    density = compiled(log_density)
    chains = max(size // settings.sweeps, 2)
    columns = uniforms_per_chain(dimension, settings.pairs)
    most = math.inf if limit is None else limit
    while power < 1.0 and evaluations + chains * settings.sweeps <= most:
        base = np.empty(len(z))
        refer(z, log_jacobian, power, reference.centre, reference.factor, base)
        gain = values + log_jacobian - base
        gain[~np.isfinite(values)] = -np.inf
        rise = next_rise(gain, 1.0 - power, settings.survivors)
        power = 1.0 if rise >= 1.0 - power else power + rise
        chosen = resample(rng, gain * rise, size)
        archive = Archive.of(z[chosen])
        tuning = tune(archive.rows, counts, settings)
        start = resample(rng, gain * rise, chains)
        tempering = Tempering(power, reference.centre, reference.factor)
        around = Around(lower, width, tuning, settings, tempering)
        target = np.empty(chains)
        temper(values[start], log_jacobian[start], base[start], power, target)
        now = Walk(z[start], x[start], values[start], target)
        counts = empty_counts(settings)
        uniforms = rng.random((settings.sweeps, chains, columns))
        _, _, path = many(uniforms, now, archive, 0, around, density, log_density, counts)
        evaluations += chains * settings.sweeps
        # Chain by chain: systematic resampling then treats every chain alike, so that modes which
        # no move connects keep their shares from temperature to temperature.
        z = path.z.swapaxes(0, 1).reshape(-1, dimension)
        x, log_jacobian = physical_all(z, lower, width)
        values = path.log_density.swapaxes(0, 1).reshape(-1)
        size = len(z)
    return Population(z, x, values, counts, power, evaluations)


def next_rise(gain: Array, most: float, survivors: float) -> float:
    """Largest rise of the power that keeps the effective share of points at `survivors`.

    The share is counted among points whose gain is finite.
    """
    finite = gain[np.isfinite(gain)]
    return float(_rise(finite - finite.max(), most, survivors))


@njit
def _rise(gain, most, survivors):  # type: ignore[no-untyped-def]
    low, high, middle = 0.0, most, most
    # Bisection on the logarithm first: rises span many decades.
    for _ in range(60):
        total = squares = 0.0
        for value in gain:
            weight = math.exp(middle * value)
            total += weight
            squares += weight * weight
        if total * total >= survivors * squares * len(gain):
            low = middle
        else:
            high = middle
        if low == most or (low > 0.0 and high / low < 1.001):
            break
        middle = math.sqrt(low * high) if low > 0.0 else high * 1e-3
    return low if low > 0.0 else high


def resample(rng: np.random.Generator, log_weights: Array, size: int) -> NDArray[np.intp]:
    """Systematic resampling: `size` indices drawn with the given log weights."""
    return np.asarray(_systematic(log_weights - log_weights.max(), rng.random(), size))


@njit(fastmath=False)
def _systematic(log_weights, first, size):  # type: ignore[no-untyped-def]
    total = 0.0
    weights = np.exp(log_weights)
    for weight in weights:
        total += weight
    chosen = np.empty(size, np.intp)
    at, reached = 0, weights[0]
    for i in range(size):
        place = (i + first) / size * total
        while reached < place and at < len(weights) - 1:
            at += 1
            reached += weights[at]
        chosen[i] = at
    return chosen
