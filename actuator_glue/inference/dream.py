"""DREAM(ZS) after Vrugt (2016): `init`, `step`, and `sample` which runs them.

Equations, and each departure from the paper with its reason: docs/dream.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator_glue.errors import InputError
from actuator_glue.inference import generation
from actuator_glue.inference.adaptation import Tuning, empty_counts, outliers, tune
from actuator_glue.inference.anneal import (
    Population,
    anneal,
    archive_reference,
    prior_reference,
    resample,
)
from actuator_glue.inference.archive import Archive
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.coordinates import check_bounds, physical_all, sampling
from actuator_glue.inference.evaluate import LogDensity, check_values, evaluate, refuse_infinite
from actuator_glue.inference.moves import uniforms_per_chain
from actuator_glue.inference.settings import Settings
from actuator_glue.records import Array

__all__ = ['Chains', 'Info', 'Settings', 'State', 'init', 'sample', 'step']


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
        mean_log_density: sum of log_density since the last look at outliers, (n,).
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
    mean_log_density: Array
    generation: int
    evaluations: int
    power: float
    lower: Array
    width: Array
    settings: Settings

    @property
    def adapting(self) -> bool:
        """Whether the next generation is burn-in."""
        return self.generation < self.settings.adaptation


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


def init(
    rng: np.random.Generator,
    log_density: LogDensity,
    lower: ArrayLike,
    upper: ArrayLike,
    settings: Settings | None = None,
    archive: ArrayLike | None = None,
    limit: int | None = None,
) -> State:
    """Start the chains, from the prior or from the posterior of an earlier run.

    Args:
        rng: the only source of randomness.
        log_density: log likelihood (m,) of points (m, p) in physical units.
        lower: lower bounds of the uniform prior, (p,).
        upper: upper bounds, (p,).
        settings: see `Settings`.
        archive: points (m, p) of an earlier run (`Chains.archive`) for a warm start.
        limit: likelihood evaluations that may be spent on the start.

    Raises:
        InputError: bounds, archive or log density cannot be used.
    """
    settings = settings or Settings()
    low, width = check_bounds(np.asarray(lower, np.float64), np.asarray(upper, np.float64))
    start = _points(rng, log_density, low, width, settings, archive, limit)
    # Chains start at points spread over the population; impossible points are no start.
    possible = np.where(np.isfinite(start.log_density), 0.0, -np.inf)
    chosen = resample(rng, possible, settings.chains)
    _, log_jacobian = physical_all(start.z[chosen], low, width)
    return State(
        x=start.x[chosen],
        z=start.z[chosen],
        log_density=start.log_density[chosen],
        log_target=start.log_density[chosen] + log_jacobian,
        archive=Archive.of(start.z),
        tuning=tune(start.z, start.counts, settings),
        fitted=len(start.z),
        counts=empty_counts(settings),
        mean_log_density=np.zeros(settings.chains),
        generation=0,
        evaluations=start.evaluations,
        power=start.power,
        lower=low,
        width=width,
        settings=settings,
    )


def _points(
    rng: np.random.Generator,
    log_density: LogDensity,
    lower: Array,
    width: Array,
    settings: Settings,
    archive: ArrayLike | None,
    limit: int | None,
) -> Population:
    """The points that become the first archive and the chains' starts."""
    d = len(lower)
    if archive is not None:
        old = sampling(_check_archive(np.asarray(archive, np.float64), lower, width), lower, width)
        reference = archive_reference(rng, settings.points(d) // 4, old, lower, width)
    else:
        reference = prior_reference(rng, settings.points(d), lower, width)
        if settings.start == 'prior':
            # As Vrugt (2016): only the chains' own points are evaluated.
            x, _ = physical_all(reference.points, lower, width)
            values = np.full(len(x), np.nan)
            values[: settings.chains] = evaluate(log_density, x[: settings.chains])
            check_values(values, x)
            counts = empty_counts(settings)
            return Population(reference.points, x, values, counts, 1.0, settings.chains)
    return anneal(rng, log_density, lower, width, reference, settings, limit)


def _check_archive(archive: Array, lower: Array, width: Array) -> Array:
    if archive.ndim != 2 or archive.shape[1] != len(lower) or len(archive) < 2:
        raise InputError(
            f'the archive for a warm start has shape {archive.shape}; '
            f'it must hold at least two points of {len(lower)} parameters'
        )
    inside = ((archive >= lower) & (archive <= lower + width)).all(axis=1)
    if inside.sum() < 2:
        raise InputError('the archive for a warm start lies outside the prior bounds')
    return archive[inside]


def step(rng: np.random.Generator, state: State, log_density: LogDensity) -> tuple[State, Info]:
    """Advance every chain by one generation; the state given is left as it is."""
    s = state.settings
    n, d = state.z.shape
    uniforms = rng.random((n, uniforms_per_chain(d, s.pairs)))
    z, x, log_jacobian, correction, label = generation.propose(
        state.z, uniforms, state.archive.capacity_rows, state.archive.size,
        state.lower, state.width, *state.tuning, s.pairs, s.unit_jump, s.jitter, s.noise,
    )  # fmt: skip
    values = evaluate(log_density, x)
    target = values + log_jacobian
    accepted, infinite = generation.accept(
        state.z, state.x, state.log_density, state.log_target,
        z, x, values, target, correction, uniforms,
    )  # fmt: skip
    if infinite >= 0:
        refuse_infinite(x[infinite])
    done = state.generation + 1
    keep = done % s.thinning == 0
    new = State(
        x=x,
        z=z,
        log_density=values,
        log_target=target,
        archive=state.archive.append(z) if keep else state.archive,
        tuning=state.tuning,
        fitted=state.fitted,
        counts=state.counts,
        mean_log_density=state.mean_log_density,
        generation=done,
        evaluations=state.evaluations + n,
        power=state.power,
        lower=state.lower,
        width=state.width,
        settings=s,
    )
    counts = state.counts.copy()
    generation.tally(state.z, z, accepted, label, state.tuning.scale, counts)
    new = new._replace(counts=counts)
    if state.adapting:
        new = _burn(rng, new, keep)
    elif keep and new.archive.size >= 2 * state.fitted:
        new = new._replace(
            tuning=tune(new.archive.newest_half, counts, s, state.tuning.crossover_cdf),
            fitted=new.archive.size,
            counts=empty_counts(s),
        )
    return new, Info(accepted, label[:, 0], label[:, 1])


def _burn(rng: np.random.Generator, new: State, look: bool) -> State:
    """Burn-in: when the archive has grown, fit the moves and rescue outlier chains."""
    mean = new.mean_log_density + new.log_density
    if not look:
        return new._replace(mean_log_density=mean)
    new = new._replace(
        tuning=tune(new.archive.newest_half, new.counts, new.settings),
        fitted=new.archive.size,
        mean_log_density=np.zeros(len(mean)),
    )
    lost = outliers(mean)
    if lost.size == 0:
        return new
    source = np.arange(len(mean))
    source[lost] = rng.choice(np.setdiff1d(source, lost), size=lost.size)
    return new._replace(
        x=new.x[source],
        z=new.z[source],
        log_density=new.log_density[source],
        log_target=new.log_target[source],
    )


def _burn_in(settings: Settings, generations: int, warm: bool) -> int:
    """Generations to discard: the adaptation; half of them where nothing led the chains in."""
    half = generations // 2
    if settings.start == 'prior' and not warm:
        return max(min(settings.adaptation, generations - 1), half)
    return min(settings.adaptation, half)


def sample(
    rng: np.random.Generator,
    log_density: LogDensity,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    evaluations: int,
    settings: Settings | None = None,
    archive: ArrayLike | None = None,
    stop: Callable[[State], bool] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Chains:
    """Draw from the posterior of a uniform prior and a log likelihood.

    The draws do not depend on `evaluations` except for their number: a shorter run is the
    beginning of a longer one, so a run that `stop` ended is repeated by asking for as many
    evaluations as it made.

    Args:
        rng: the only source of randomness; equal generators give equal bits.
        log_density: log likelihood (m,) of points (m, p) in physical units; called with all chains
            at once. Not-a-number means impossible.
        lower: lower bounds of the uniform prior, (p,) [physical units].
        upper: upper bounds, (p,) [physical units].
        evaluations: likelihood evaluations at most, the search for the start included.
        settings: see `Settings`.
        archive: points (m, p) of an earlier run (`Chains.archive`) for a warm start.
        stop: asked after every generation; True ends the run.
        progress: called now and then with (evaluations made, evaluations at most).

    Raises:
        InputError: bounds, archive, settings or log density cannot be used, or `evaluations` does
            not even suffice for the start.
    """
    settings = settings or Settings()
    # Whatever the start costs, some generations remain to be seen.
    limit = evaluations - 4 * settings.chains
    state = init(rng, log_density, lower, upper, settings, archive, limit)
    n, d = state.x.shape
    generations = (evaluations - state.evaluations) // n
    if generations < 2:
        raise InputError(
            f'{evaluations} evaluations are used up by the start ({state.evaluations}); '
            f'give at least {state.evaluations + n * (settings.adaptation + 100)}'
        )
    spent = state.evaluations
    draws = np.empty((generations, n, d))
    log_densities = np.empty((generations, n))
    every = max(generations // 100, 1)
    done = 0
    while done < generations:
        state, _ = step(rng, state, log_density)
        draws[done] = state.x
        log_densities[done] = state.log_density
        done += 1
        if progress is not None and done % every == 0:
            progress(state.evaluations, evaluations)
        if stop is not None and stop(state):
            break
    return Chains(
        draws=draws[:done],
        log_density=log_densities[:done],
        evaluations=state.evaluations,
        start_evaluations=spent,
        burn=_burn_in(settings, done, archive is not None),
        annealed=state.power == 1.0,
    )
