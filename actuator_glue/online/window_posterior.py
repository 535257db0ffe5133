"""The posterior of one window: its job in, chains and what the next window needs out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import DRAWS, FEWEST, Carried, later
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.inference.convergence import quick_rhat_and_ess
from actuator_glue.inference.informative_prior import carried_coordinates
from actuator_glue.inference.normal_fit import refined
from actuator_glue.inference.posterior import Problem, Target, sample
from actuator_glue.inference.predictive import ResidualModel, fit_residual
from actuator_glue.inference.prior_conflict import Conflict, conflict
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.inference.state import State
from actuator_glue.model import linear
from actuator_glue.online import fitting
from actuator_glue.online.forecast import FrozenPosterior
from actuator_glue.online.sensor_noise import sensor_noise, white_noise
from actuator_glue.online.settings import AUTOMATIC, EstimatorSettings
from actuator_glue.online.shaping import automatic
from actuator_glue.online.stream import Window
from actuator_glue.online.structures import Proposal
from actuator_glue.records import Array, Record

# A command that moves less than this many noise standard deviations calibrates nothing.
EXCITATION = 3.0
# Adaptation steps of a sampler that starts from the last posterior.
ADAPT = 20
# Time a model's first window may take [s], whatever the budget: before there is a posterior
# nothing is late, and the window after one that is cut short would start where that did.
FIRST = 1.0
# Largest time limit of a window, in budgets, after windows that ended without a posterior.
MOST_PATIENCE = 8.0
# Effective share of the last posterior's points to keep at the next temperature: small enough
# that one temperature mostly suffices.
SURVIVORS = 0.35
# Points that a window hands to the next, about as many as its draws are worth.
ARCHIVE = 400


@dataclass(frozen=True, slots=True, eq=False)
class Job:
    """All that one window's estimate depends on.

    Attributes:
        window: the samples.
        settings: settings of the estimator.
        model: model to fit.
        archive: points to start from, shape (m, p); None starts from the prior.
        afresh: the model or the actuator is new, more evaluations are needed.
        stop_at: evaluations after which a live run was stopped; a replay repeats it.
        ahead: commands from the window's end to the forecast's, shape (na,) [m], where known.
        frozen: earlier posteriors whose forecasts this window's samples judge.
        prior: prior from earlier samples; None for the box alone.
        rivals: jobs of the other structures carried, which only forecast from this window on.
        weight: weight of the model among the structures carried, before the window.
        proposal: proposal that is carried from this window on, if it is new.
        standing: last posterior of a structure not sampled here; its forecasts use it.
        renewed: a rival's likelihood evaluations for a result since the window before; else 0.
        patience: time limit in budgets, raised after windows that ran out of time before they
            had a posterior.
    """

    window: Window
    settings: EstimatorSettings
    model: ModelChoice
    archive: Array | None = None
    afresh: bool = True
    stop_at: int | None = None
    ahead: Array | None = None
    frozen: tuple[FrozenPosterior, ...] = ()
    prior: Carried | None = None
    rivals: tuple[Job, ...] = ()
    weight: float = 1.0
    proposal: Proposal | None = None
    standing: FrozenPosterior | None = None
    renewed: int = 0
    patience: float = 1.0

    @property
    def evaluations(self) -> int:
        """Likelihood evaluations allowed, those of chains that only fill a batch included."""
        steps = self.settings.evaluations // self.settings.chains
        usual = max(self.settings.evaluations, steps * self.chains)
        return max(self.settings.start_evaluations, usual) if self.afresh else usual

    @property
    def seconds(self) -> float:
        """Longest time the window may be computed [s]."""
        budget = self.settings.time_budget
        return self.patience * (max(budget, FIRST) if self.afresh else budget)

    @property
    def forecast(self) -> tuple[int, int]:
        """Running index of the first sample the posterior forecasts, and one past the last."""
        settings, end, period = self.settings, self.window.end, self.window.record.period
        hop = max(1, round(settings.hop / period))
        start = end + min(round(settings.time_budget / period), hop)
        return start, start + hop

    @property
    def chains(self) -> int:
        """Number of Markov chains; effects are simulated in batches, which chains fill up."""
        wanted = self.settings.chains
        return fitting.batch(wanted) if self.model.effects else wanted


@dataclass(frozen=True, slots=True, eq=False)
class WindowFit:
    """One window's posterior: all that the next window and the report need.

    Attributes:
        window: the samples.
        model: fitted model.
        chains: draws of the physical parameters, with log likelihoods.
        rms_error: rms of measured minus best simulated displacement, mean removed [m].
        nrmse: rms_error over the standard deviation of the measured displacement.
        shaping_factor: G of Eq. (4); NaN for a formal likelihood.
        frozen: the posterior, whose forecast later samples will judge.
        archive: points to start from, shape (m, p).
        learned: the posterior, for the priors of later windows; None where none is wanted, or the
            window was cut so short that it says nothing.
        conflict: how far the window contradicts its prior; None where that is the box.
        complete: the sampling was not ended early.
        failure: why there is no posterior; empty where there is one.
        starved: there is no posterior because the sampling ended before it had reached it.
        evaluations: likelihood evaluations of a rival structure: at least 1 for a new result, even
            a failed one; 0 without a new result since the window before.
        rivals: fits of the other structures carried: the posteriors they forecast with.
        errors: mean square error of each structure's forecast of the window's samples, the
            likeliest structure first [m^2]; empty without rivals or forecasts.
    """

    window: Window
    model: ModelChoice
    chains: Chains | None = None
    rms_error: float = float('nan')
    nrmse: float = float('nan')
    shaping_factor: float = float('nan')
    frozen: FrozenPosterior | None = None
    archive: Array | None = None
    learned: Carried | None = None
    conflict: Conflict | None = None
    complete: bool = False
    failure: str = ''
    starved: bool = False
    evaluations: int = 0
    rivals: tuple[WindowFit, ...] = ()
    errors: tuple[float, ...] = ()


def fit(job: Job, expired: Callable[[], bool] | None = None) -> WindowFit:
    """Sample one window.

    Args:
        job: what to compute.
        expired: tells that the time is spent; None never stops early.

    Raises:
        InputError: the window calibrates nothing.
    """
    record = job.window.record
    settle = round(job.settings.settle / record.period)
    white = white_noise(record.measured)
    moved = _check_excited(record, settle, white)
    # A copied or dead channel, or millimetres for metres, is fitted as well as any: as in files.
    record.check_channels()
    near = None
    if job.archive is not None:
        near = np.sort(job.archive, axis=0)[len(job.archive) // 2]
    shaping = _shaping(job, settle, near)
    target = _target(job, shaping, near)
    chains, complete = _sample(job, target, expired)
    posterior = chains.posterior()
    best = fitting.simulate(job.model, chains.best[np.newaxis], record)[0]
    residual = (record.measured - best)[settle:]
    rms_error = float(residual.std())
    return WindowFit(
        window=job.window,
        model=job.model,
        chains=chains,
        rms_error=rms_error,
        nrmse=rms_error / moved,
        shaping_factor=shaping,
        frozen=_frozen(
            job,
            posterior[spread(len(posterior), job.settings.draws)],
            fit_residual(residual, parameters=len(job.model.names)),
            sensor_noise(residual, record.command[settle:], white),
        ),
        archive=joined(posterior[spread(len(posterior), ARCHIVE)], job.archive),
        learned=_learned(job, chains, posterior),
        conflict=None if target.prior is None else conflict(target.prior, posterior),
        complete=complete,
    )


def _learned(job: Job, chains: Chains, posterior: Array) -> Carried | None:
    """Return the posterior for later windows' priors, without the scatter of draws (m, p).

    It becomes a normal density in the coordinates of the prior: along directions that no window
    informs, the prior passes through unchanged.
    """
    model = job.model
    wanted = job.settings.prior == 'sequential' and chains.annealed
    if not wanted or len(posterior) < FEWEST:
        return None
    coordinates = carried_coordinates(
        model.names, *model.bounds, job.window.record.known_stiffness()
    )
    some = spread(len(posterior), DRAWS)
    at = coordinates.forward(posterior[some])
    log_density = chains.log_density[chains.burn :].reshape(-1)[some] + coordinates.inverse(at)[1]
    draws, log_jacobian = coordinates.inverse(refined(at, log_density))
    return Carried(model.names, draws[np.isfinite(log_jacobian)])


def _frozen(job: Job, draws: Array, residual: ResidualModel, noise: float) -> FrozenPosterior:
    """Return draws (m, p), frozen with all that a forecast from a job's window needs."""
    start, stop = job.forecast
    return FrozenPosterior(
        number=job.window.number,
        segment=job.window.segment,
        start=start,
        stop=stop,
        model=job.model,
        draws=draws,
        residual=residual,
        noise=noise,
        past=_past(job, start),
        weight=job.weight,
    )


def stands(job: Job) -> FrozenPosterior | None:
    """Return the last posterior of a structure not sampled in this window, to forecast with.

    None where it has none yet. A drifting gain is advanced to the window.
    """
    old = job.standing
    if old is None:
        return None
    seconds = (job.window.record.start_ns - old.past.start_ns) * 1e-9
    draws = later(job.model.names, old.draws, seconds)
    return _frozen(job, draws, old.residual, old.noise)


def _past(job: Job, start: int) -> Record:
    """Return the last samples of a window, from which a forecast from `start` on runs up.

    Twice the settling time before the forecast, and always enough for the initial state.
    """
    record, settle = job.window.record, round(job.settings.settle / job.window.record.period)
    # The state of Eq. (2) decays; an effect's may depend on the whole window (yield, drift).
    if job.model.effects or settle == 0:
        return record
    known = len(record) - linear.initial_samples(record)
    begin = min(start - record.first_index - 2 * settle, known)
    return record.slice(max(0, begin), len(record))


def _shaping(job: Job, settle: int, near: Array | None) -> float:
    """Return G: given, or of this window; NaN where the likelihood has none."""
    settings = job.settings
    if settings.likelihood != 'glue':
        return float('nan')
    if settings.shaping_factor != AUTOMATIC:
        return settings.shaping_factor
    return automatic(job.window.record, job.model, settle, near)


def _target(job: Job, shaping: float, near: Array | None) -> Target:
    """Return the target density of the sampler."""
    settings, model, record = job.settings, job.model, job.window.record
    return Problem(
        records=(record,),
        model=model,
        likelihood=settings.likelihood,
        shaping_factor=shaping,
        initial='measured',
        settle=settings.settle,
        first_index=record.first_index,
        near=near,
        # Points of another model say nothing about the curvature of this one's posterior.
        shown=None if job.afresh else job.archive,
        prior=job.prior,
    ).target()


def _sample(job: Job, target: Target, expired: Callable[[], bool] | None) -> tuple[Chains, bool]:
    """Return chains of physical parameters, and whether the sampling is complete."""
    settings, record = job.settings, job.window.record
    archive = job.archive
    if archive is not None and target.transform is not None:
        archive = target.transform.forward(archive)
    complete = False

    def enough(sampled: Chains) -> bool:
        nonlocal complete
        rhat, ess = quick_rhat_and_ess(sampled.kept)
        limit = 0.5 * (1.0 + settings.rhat_limit)
        complete = bool(sampled.annealed and ess.min() >= settings.ess and rhat.max() <= limit)
        return complete

    chains = sample(
        target,
        (settings.seed, record.first_index),
        job.evaluations,
        settings=_sampler(job),
        archive=archive,
        stop=_stop(job, expired),
        enough=enough,
    )
    complete = complete or chains.evaluations + job.chains > job.evaluations
    return chains, complete


def _stop(job: Job, expired: Callable[[], bool] | None) -> Callable[[State], bool] | None:
    """Return the rule that ends sampling early: evaluations of a repeated run, or the clock."""
    if job.stop_at is not None:
        at = job.stop_at
        return lambda state: state.evaluations >= at
    if expired is None:
        return None
    return lambda state: expired()


def _sampler(job: Job) -> SamplerSettings:
    """Settings of the sampler."""
    # A window is short, and begins where the last one ended: its adaptation is all its burn-in.
    base = SamplerSettings(chains=job.chains, adaptation=ADAPT, burn_in=0.0)
    if job.archive is None:
        return replace(base, adaptation=50)
    if not job.model.effects:
        return replace(base, survivors=SURVIVORS)
    # A warm start takes a quarter of the population, and moves a chain of so many steps each:
    # batches are full.
    return replace(base, population=4 * base.steps * job.chains)


def joined(new: Array, old: Array | None) -> Array:
    """Return points for the next window; if a window cut short has few, older ones are added."""
    if old is None or len(new) >= ARCHIVE:
        return new
    return np.concatenate([new, old[spread(len(old), ARCHIVE - len(new))]])


def _check_excited(record: Record, settle: int, noise: float) -> float:
    """Return the standard deviation of the measured displacement [m]."""
    commanded, moved = (float(x[settle:].std()) for x in (record.command, record.measured))
    if commanded <= EXCITATION * noise or commanded == 0.0 or moved == 0.0:
        raise InputError(
            f'nothing moves: the command varies by {commanded * 1e6:.3g} um rms, the sensor noise '
            f'is {noise * 1e6:.3g} um (or {record.rate:g} Hz are too few samples to tell motion '
            'from noise); the window calibrates nothing and is left out'
        )
    return moved


@lru_cache(maxsize=64)
def spread(count: int, wanted: int) -> NDArray[np.intp]:
    """Return at most `wanted` of the indices of `count` items, spread evenly."""
    indices = np.linspace(0, count - 1, min(count, wanted)).astype(np.intp)
    indices.flags.writeable = False
    return indices
