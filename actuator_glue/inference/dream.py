"""DREAM(ZS) after Vrugt (2016): `init`, `step`, and `sample` which runs them.

Equations, and each departure from the paper with its reason: docs/dream.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.inference.adaptation import empty_counts, tuned
from actuator_glue.inference.anneal import resample
from actuator_glue.inference.archive import Archive
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.compiled import compiled
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.inference.moves.move import Tuning, uniforms_per_chain
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.start import population
from actuator_glue.inference.state import Info, State
from actuator_glue.inference.steps import ChainState, Path, enter, many, one
from actuator_glue.inference.transforms.log import Log
from actuator_glue.records import Array

# Evaluations of a compiled likelihood between two checks whether to stop: 0.2 ms; and in one go
# without such checks: the uniforms of more would leave the cache.
_PATIENCE, _MOST = 200, 2000
# Parts of a run before `enough` is asked for the first time.
_FIRST = 5

__all__ = ['Chains', 'Info', 'SamplerSettings', 'State', 'Watchers', 'init', 'sample', 'step']


def init(
    rng: np.random.Generator,
    log_density: LogDensity,
    lower: ArrayLike,
    upper: ArrayLike,
    settings: SamplerSettings | None = None,
    archive: ArrayLike | None = None,
    limit: int | None = None,
) -> State:
    """Start the chains, from the prior or from the posterior of an earlier run.

    Args:
        rng: the only source of randomness.
        log_density: log likelihood (m,) of points (m, p) in physical units.
        lower: lower bounds of the uniform prior, (p,).
        upper: upper bounds, (p,).
        settings: see `SamplerSettings`.
        archive: points (m, p) of an earlier run (`Chains.archive`) for a warm start.
        limit: likelihood evaluations that may be spent on the start.

    Raises:
        InputError: bounds, archive or log density cannot be used.
    """
    settings = settings or SamplerSettings()
    box = Log(lower, upper)
    start = population(rng, log_density, box, settings, archive, limit)
    # Chains start at points spread over the population one temperature above the posterior: R-hat
    # compares chains that began further apart than they must end. Impossible points are no start.
    wide, z = start.before, start.points.z
    possible = np.where(np.isfinite(wide.log_density), 0.0, -np.inf)
    chosen = resample(rng, possible, settings.chains)
    _, log_jacobian = box.inverse(wide.z[chosen])
    return State(
        now=ChainState(
            z=wide.z[chosen],
            x=wide.x[chosen],
            log_density=wide.log_density[chosen],
            log_target=wide.log_density[chosen] + log_jacobian,
        ),
        archive=Archive.of(z),
        context=tuned(z, start.counts, settings, box),
        fitted=len(z),
        counts=empty_counts(settings),
        sum_log_density=np.zeros(settings.chains),
        made=0,
        evaluations=start.evaluations,
        power=start.power,
        settings=settings,
        log_density=log_density,
    )


def step(rng: np.random.Generator, state: State) -> tuple[State, Info]:
    """Advance every chain by one step; the state given is left as it is."""
    state = _own(state)
    course, archive, fitted = state.course, state.archive, state.fitted
    now, accepted, label = one(
        _uniforms(rng, state, 1)[0],
        state.now,
        archive,
        state.context,
        course.moves,
        state.log_density,
        state.counts,
    )
    if state.adapting:
        state.sum_log_density[:] += now.log_density
    if state.until_append == 1:
        archive, fitted = enter(now, archive, state.context, state.counts, state.learning)
    return _later(state, now, archive, fitted, 1), Info(accepted, label[:, 0], label[:, 1])


def stretch(rng: np.random.Generator, state: State, count: int) -> tuple[State, Path]:
    """Advance every chain by `count` steps.

    The state is that of as many `step`s, bit by bit; with a compiled likelihood it is there
    sooner.
    """
    state = _own(state)
    now, archive, fitted, path = many(
        _uniforms(rng, state, count),
        state.now,
        state.archive,
        state.course,
        state.counts,
        state.until_append,
        state.learning,
    )
    return _later(state, now, archive, fitted, count), path


def _uniforms(rng: np.random.Generator, state: State, count: int) -> Array:
    n, d = state.now.z.shape
    columns = uniforms_per_chain(state.settings.moves, d, state.settings.pairs)
    return rng.random((count, n, columns))


def _own(state: State) -> State:
    """Return the state with arrays of its own for what steps change in place."""
    tuning = Tuning(*(part.copy() for part in state.context.tuning))
    return state._replace(
        counts=state.counts.copy(),
        sum_log_density=state.sum_log_density.copy(),
        context=state.context._replace(tuning=tuning),
    )


def _later(state: State, now: ChainState, archive: Archive, fitted: int, steps: int) -> State:
    """Return the state some steps later, `fitted` the archive's size at the last fit."""
    return state._replace(
        now=now,
        archive=archive,
        fitted=fitted,
        made=state.made + steps,
        evaluations=state.evaluations + steps * len(now.z),
    )


def _burn_in(settings: SamplerSettings, steps: int) -> int:
    """Steps to discard of so many: a share of the run, and never less than the adaptation."""
    return min(max(settings.adaptation, int(settings.burn_in * steps)), steps)


class Watchers(NamedTuple):
    """What is asked whether a run goes on, and told how far it has come.

    Attributes:
        stop: asked after every step, or about every 200 evaluations where the likelihood has a
            compiled form, always at the same ones; True ends the run.
        enough: asked after every one of the settings' parts, from the fifth on, whether the draws
            suffice; True ends the run.
        progress: called now and then with (evaluations made, evaluations at most).
    """

    stop: Callable[[State], bool] | None = None
    enough: Callable[[Chains], bool] | None = None
    progress: Callable[[int, int], None] | None = None


def sample(
    rng: np.random.Generator,
    log_density: LogDensity,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    evaluations: int,
    settings: SamplerSettings | None = None,
    archive: ArrayLike | None = None,
    watch: Watchers | None = None,
) -> Chains:
    """Draw from the posterior of a uniform prior and a log likelihood.

    The draws do not depend on `evaluations` except for their number: a shorter run is the
    beginning of a longer one, so a run that `watch.stop` ended is repeated by asking for as many
    evaluations as it made.

    Args:
        rng: the only source of randomness; equal generators give equal bits.
        log_density: log likelihood (m,) of points (m, p) in physical units; called with all chains
            at once. Not-a-number means impossible.
        lower: lower bounds of the uniform prior, (p,) [physical units].
        upper: upper bounds, (p,) [physical units].
        evaluations: likelihood evaluations at most, the search for the start included.
        settings: see `SamplerSettings`.
        archive: points (m, p) of an earlier run (`Chains.archive`) for a warm start.
        watch: what is asked whether to go on, and told how far the run has come.

    Raises:
        InputError: bounds, archive, settings or log density cannot be used, or `evaluations` does
            not even suffice for the start.
    """
    settings = settings or SamplerSettings()
    stop, enough, progress = watch or Watchers()
    # Whatever the start costs, some steps remain to be seen.
    limit = evaluations - 4 * settings.chains
    state = init(rng, log_density, lower, upper, settings, archive, limit)
    n, d = state.now.x.shape
    steps = (evaluations - state.evaluations) // n
    if steps < 2:
        raise InputError(
            f'{evaluations} evaluations are used up by the start ({state.evaluations}), which is '
            'cut where they end: give several times as many'
        )
    spent = state.evaluations
    draws = np.empty((steps, n, d))
    log_densities = np.empty((steps, n))
    most = -(-_MOST // n)
    if stop is not None:
        most = 1 if compiled(log_density) is None else -(-_PATIENCE // n)
    every = max(steps // 100, 1)
    parts = range(_FIRST, settings.parts) if enough is not None else range(0)
    looks = [int(k / settings.parts * steps) for k in parts]

    def so_far(done: int) -> Chains:
        return Chains(
            draws=draws[:done],
            log_density=log_densities[:done],
            evaluations=state.evaluations,
            start_evaluations=spent,
            burn=_burn_in(settings, done),
            annealed=state.power == 1.0,
        )

    done = 0
    while done < steps:
        ahead = min((look for look in looks if look > done), default=steps) - done
        state, path = stretch(rng, state, min(most, ahead))
        new = done + len(path.x)
        draws[done:new], log_densities[done:new] = path.x, path.log_density
        if progress is not None and new // every > done // every:
            progress(state.evaluations, evaluations)
        done = new
        # In this order: where a replay's `stop` ends the run, `enough` has been asked, too.
        if enough is not None and done in looks and enough(so_far(done)):
            break
        if stop is not None and stop(state):
            break
    return so_far(done)
