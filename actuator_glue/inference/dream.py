"""DREAM(ZS) after Vrugt (2016): `init`, `step`, and `sample` which runs them.

Equations, and each departure from the paper with its reason: docs/dream.md.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.inference.adaptation import Tuning, empty_counts, tune
from actuator_glue.inference.anneal import (
    Population,
    anneal,
    archive_reference,
    prior_reference,
    resample,
)
from actuator_glue.inference.archive import Archive
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.compiled import Compiled, compiled
from actuator_glue.inference.coordinates import check_bounds, physical_all, sampling
from actuator_glue.inference.evaluate import LogDensity, check_values, evaluate
from actuator_glue.inference.moves import uniforms_per_chain
from actuator_glue.inference.settings import Settings
from actuator_glue.inference.state import Info, State, moved
from actuator_glue.inference.sweep import Path, enter, many, one
from actuator_glue.records import Array

# Evaluations of a compiled likelihood between two questions whether to stop: 0.2 ms; and in one go
# where nobody asks: the uniforms of more would leave the cache.
_PATIENCE, _MOST = 200, 2000
# Shares of the generations after which a run may have drawn enough.
_LOOKS = tuple(k / 16.0 for k in range(5, 16))

__all__ = ['Chains', 'Info', 'Settings', 'State', 'init', 'sample', 'step']


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
        sum_log_density=np.zeros(settings.chains),
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
    return archive if inside.all() else archive[inside]


def step(rng: np.random.Generator, state: State, log_density: LogDensity) -> tuple[State, Info]:
    """Advance every chain by one generation; the state given is left as it is."""
    state = _own(state)
    uniforms = rng.random(
        (len(state.z), uniforms_per_chain(state.z.shape[1], state.settings.pairs))
    )
    walk, accepted, label = one(
        uniforms, state.walk, state.archive, state.around, log_density, state.counts
    )
    archive, fitted = state.archive, state.fitted
    if state.burn_in:
        state.sum_log_density[:] += walk.log_density
    if state.until_append == 1:
        archive, fitted = enter(walk, archive, state.around, state.counts, state.learning)
    new = moved(state, walk, archive, fitted, state.counts, 1)
    return new, Info(accepted, label[:, 0], label[:, 1])


def stretch(
    rng: np.random.Generator,
    state: State,
    log_density: LogDensity,
    density: Compiled | None,
    count: int,
) -> tuple[State, Path]:
    """Advance every chain by `count` generations.

    The state is that of as many `step`s, bit by bit; with a compiled likelihood it is there
    sooner.
    """
    state = _own(state)
    columns = uniforms_per_chain(state.z.shape[1], state.settings.pairs)
    walk, archive, fitted, path = many(
        rng.random((count, len(state.z), columns)), state.walk, state.archive, state.until_append,
        state.around, density, log_density, state.counts, state.learning,
    )  # fmt: skip
    return moved(state, walk, archive, fitted, state.counts, count), path


def _own(state: State) -> State:
    """Return the state with arrays of its own for what generations change in place."""
    return state._replace(
        counts=state.counts.copy(),
        sum_log_density=state.sum_log_density.copy(),
        tuning=Tuning(*(part.copy() for part in state.tuning)),
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
    enough: Callable[[Chains], bool] | None = None,
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
        stop: asked after every generation, or about every 200 evaluations where the likelihood
            has a compiled form, always at the same ones; True ends the run.
        enough: asked at every sixteenth of the run from the fifth on whether its draws will do;
            True ends it.
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
    density = compiled(log_density)
    most = -(-_MOST // n)
    if stop is not None:
        most = 1 if density is None else -(-_PATIENCE // n)
    every = max(generations // 100, 1)
    looks = [int(share * generations) for share in _LOOKS] if enough is not None else []

    def so_far(done: int) -> Chains:
        return Chains(
            draws=draws[:done],
            log_density=log_densities[:done],
            evaluations=state.evaluations,
            start_evaluations=spent,
            burn=_burn_in(settings, done, archive is not None),
            annealed=state.power == 1.0,
        )

    done = 0
    while done < generations:
        ahead = min((look for look in looks if look > done), default=generations) - done
        state, path = stretch(rng, state, log_density, density, min(most, ahead))
        new = done + len(path.x)
        draws[done:new], log_densities[done:new] = path.x, path.log_density
        if progress is not None and new // every > done // every:
            progress(state.evaluations, evaluations)
        done = new
        # In this order: what had drawn enough is told so when `stop` repeats where it ended.
        if enough is not None and done in looks and enough(so_far(done)):
            break
        if stop is not None and stop(state):
            break
    return so_far(done)
