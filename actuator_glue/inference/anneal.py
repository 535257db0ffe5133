"""From the prior, or from an earlier posterior, to the posterior by tempering.

The targets are pi_b(z) = r(z)^(1-b) p(z)^b with r the reference the points start from, p the
posterior and b rising from 0 to 1 by steps that keep a set share of the points alive:
sequential Monte Carlo (Del Moral, Doucet and Jasra 2006) in the form that keeps every state of
every chain (Dau and Chopin 2022), with the sampler's own moves. It only chooses where chains start
and what the first archive holds; nothing of it enters the posterior draws.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference import generation
from actuator_glue.inference.adaptation import empty_counts, tune
from actuator_glue.inference.coordinates import physical_all, sampling
from actuator_glue.inference.evaluate import LogDensity, check_values, evaluate, refuse_infinite
from actuator_glue.inference.moves import independence, uniforms_per_chain
from actuator_glue.inference.settings import Settings
from actuator_glue.records import Array


class Reference(NamedTuple):
    """Where annealing starts: points z (m, p) and their log density as a function.

    `log_density(z, log_jacobian)` gives (m,), less a constant.
    """

    points: Array
    log_density: Callable[[Array, Array], Array]


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
    return Reference(sampling(x, lower, width), lambda z, log_jacobian: log_jacobian)


def archive_reference(
    rng: np.random.Generator, size: int, archive: Array, lower: Array, width: Array
) -> Reference:
    """Student t fitted to an earlier posterior z (m, p), half as wide again.

    Points beyond a bound are replaced by points of the archive: they only start the search.
    """
    centre, factor = independence.fit(archive)
    factor *= 1.5
    points = np.empty((size, archive.shape[1]))
    uniforms = rng.random((size, archive.shape[1] + 5))
    for point, row in zip(points, uniforms, strict=True):
        independence.draw(row, 0, centre, factor, point)
    outside = np.isneginf(physical_all(points, lower, width)[1])
    points[outside] = archive[rng.integers(0, len(archive), int(outside.sum()))]
    return Reference(points, lambda z, _: independence.log_density(z, centre, factor))


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
    chains = max(size // settings.sweeps, 2)
    columns = uniforms_per_chain(dimension, settings.pairs)
    most = math.inf if limit is None else limit
    while power < 1.0 and evaluations + chains * settings.sweeps <= most:
        gain = values + log_jacobian - reference.log_density(z, log_jacobian)
        gain[~np.isfinite(values)] = -np.inf
        rise = next_rise(gain, 1.0 - power, settings.survivors)
        power = 1.0 if rise >= 1.0 - power else power + rise
        chosen = resample(rng, gain * rise, size)
        archive = np.ascontiguousarray(z[chosen])
        tuning = tune(archive, counts, settings)
        start = resample(rng, gain * rise, chains)
        now = z[start], x[start], values[start]
        target = _target(reference, power, now[0], values[start], log_jacobian[start])
        history = []
        counts = empty_counts(settings)
        for _ in range(settings.sweeps):
            uniforms = rng.random((chains, columns))
            new_z, new_x, new_jacobian, correction, label = generation.propose(
                now[0], uniforms, archive, size, lower, width, *tuning,
                settings.pairs, settings.unit_jump, settings.jitter, settings.noise,
            )  # fmt: skip
            new_values = evaluate(log_density, new_x)
            new_target = _target(reference, power, new_z, new_values, new_jacobian)
            accepted, infinite = generation.accept(
                *now, target, new_z, new_x, new_values, new_target, correction, uniforms
            )
            if infinite >= 0:
                refuse_infinite(new_x[infinite])
            generation.tally(now[0], new_z, accepted, label, tuning.scale, counts)
            now, target = (new_z, new_x, new_values), new_target
            history.append(now)
        evaluations += chains * settings.sweeps
        # Chain by chain: systematic resampling then treats every chain alike, so that modes which
        # no move connects keep their shares from temperature to temperature.
        z = np.stack([h[0] for h in history], axis=1).reshape(-1, dimension)
        x, log_jacobian = physical_all(z, lower, width)
        values = np.stack([h[2] for h in history], axis=1).reshape(-1)
        size = len(z)
    return Population(z, x, values, counts, power, evaluations)


def _target(
    reference: Reference, power: float, z: Array, values: Array, log_jacobian: Array
) -> Array:
    posterior = values + log_jacobian
    if power == 1.0:
        return posterior
    return (1.0 - power) * reference.log_density(z, log_jacobian) + power * posterior


def next_rise(gain: Array, most: float, survivors: float) -> float:
    """Largest rise of the power that keeps the effective share of points at `survivors`.

    The share is counted among points whose gain is finite.
    """
    finite = gain[np.isfinite(gain)]
    finite = finite - finite.max()

    def share(rise: float) -> float:
        weights = np.exp(rise * finite)
        return float(weights.sum() ** 2 / (weights @ weights) / len(finite))

    if share(most) >= survivors:
        return most
    low, high = 0.0, most
    # Bisection on the logarithm first: rises span many decades.
    for _ in range(60):
        middle = np.sqrt(low * high) if low > 0.0 else high * 1e-3
        if share(middle) >= survivors:
            low = middle
        else:
            high = middle
        if low > 0.0 and high / low < 1.001:
            break
    return low if low > 0.0 else high


def resample(rng: np.random.Generator, log_weights: Array, size: int) -> NDArray[np.intp]:
    """Systematic resampling: `size` indices drawn with the given log weights."""
    weights = np.exp(log_weights - log_weights.max())
    cumulative = np.cumsum(weights)
    places = (np.arange(size) + rng.random()) / size * cumulative[-1]
    return np.asarray(np.minimum(np.searchsorted(cumulative, places), len(weights) - 1))
