"""One window's work as a pure function: job in, result out; runs in any process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.inference import convergence, dream
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.inference.likelihood import GaussianLikelihood, GlueLikelihood
from actuator_glue.inference.moments import Moments, moments
from actuator_glue.inference.predictive import fit_residual
from actuator_glue.online import fitting
from actuator_glue.online.coordinates import Coordinates
from actuator_glue.online.forecast import Frozen, Prediction, predictions, sensor_noise
from actuator_glue.online.response import ResponseBand, response_band
from actuator_glue.online.settings import EstimatorSettings, ModelChoice
from actuator_glue.online.stream import Window
from actuator_glue.records import Array, Record

# A command that moves less than this many noise standard deviations calibrates nothing.
EXCITATION = 3.0
# Generations in which a sampler that starts from the last posterior adapts.
ADAPT = 20
# Points that a window hands to the next, at least.
ARCHIVE = 400
# Generations that R-hat and ESS are computed from.
DIAGNOSED = 150


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
        ahead: commands after the window as far as they are known, shape (na,) [m].
        frozen: earlier posteriors whose forecasts this window's samples judge.
    """

    window: Window
    settings: EstimatorSettings
    model: ModelChoice
    archive: Array | None = None
    afresh: bool = True
    stop_at: int | None = None
    ahead: Array | None = None
    frozen: tuple[Frozen, ...] = ()

    @property
    def evaluations(self) -> int:
        """Likelihood evaluations the window is allowed; of chains that fill a batch up, too."""
        generations = self.settings.evaluations // self.settings.chains
        usual = max(self.settings.evaluations, generations * self.chains)
        return max(self.settings.start_evaluations, usual) if self.afresh else usual

    @property
    def chains(self) -> int:
        """Markov chains; effects are simulated in batches, which are filled up."""
        wanted = self.settings.chains
        return fitting.batch(wanted) if self.model.effects else wanted


@dataclass(frozen=True, slots=True, eq=False)
class WindowResult:
    """What one window says.

    Attributes:
        window: the samples it was computed from.
        settings: settings it was computed with.
        model: fitted model.
        moments: posterior moments, one entry per parameter; None where `failure` says why.
        best: draw of the highest likelihood, shape (p,).
        rhat: rank-normalised split R-hat, shape (p,).
        ess: bulk effective sample size, shape (p,).
        prior_dominated: True where the window says little more than the prior, shape (p,).
        rms_error: rms of measured minus best simulated displacement, mean removed [m].
        nrmse: rms_error over the standard deviation of the measured displacement.
        noise: standard deviation of the sensor noise [m].
        evaluations: likelihood evaluations done.
        stopped_early: the time budget ended the sampling.
        converged: largest R-hat is at or below its limit.
        response: frequency-response band.
        scored: bands of earlier posteriors over samples of this window, with their coverage.
        forecast: bands over samples to come, where their command is known.
        frozen: the posterior, to be held against later samples.
        archive: points for the next window to start from.
        failure: why there is no posterior; empty where there is one.
    """

    window: Window
    settings: EstimatorSettings
    model: ModelChoice
    moments: Moments | None = None
    best: Array | None = None
    rhat: Array | None = None
    ess: Array | None = None
    prior_dominated: tuple[bool, ...] = ()
    rms_error: float = float('nan')
    nrmse: float = float('nan')
    noise: float = 0.0
    evaluations: int = 0
    stopped_early: bool = False
    converged: bool = False
    response: ResponseBand | None = None
    scored: tuple[Prediction, ...] = ()
    forecast: tuple[Prediction, ...] = ()
    frozen: Frozen | None = None
    archive: Array | None = None
    failure: str = ''


def run(job: Job, expired: Callable[[], bool] | None = None) -> WindowResult:
    """Estimate one window.

    The result depends on the job alone, but where `expired` ends the sampling; the result then
    says so and how many evaluations were done, and a job with that `stop_at` repeats it.

    Args:
        job: what to compute.
        expired: tells that the time budget is spent; None never stops early.
    """
    try:
        return _estimate(job, expired)
    except InputError as error:
        return WindowResult(job.window, job.settings, job.model, failure=str(error))


def _estimate(job: Job, expired: Callable[[], bool] | None) -> WindowResult:
    settings, model, record = job.settings, job.model, job.window.record
    settle = round(settings.settle / record.period)
    noise = sensor_noise(record.measured)
    _check_excited(record, settle, noise)

    near = None if job.archive is None else np.median(job.archive, axis=0)
    errors = fitting.errors(model, record, settle, near)
    likelihood: LogDensity = (
        GlueLikelihood(errors, settings.shaping_factor)
        if settings.likelihood == 'glue'
        else GaussianLikelihood(errors)
    )
    # What another model has shown says nothing about this one's bends.
    shown = None if job.afresh else job.archive
    middle = (record.first_index + 0.5 * len(record)) * record.period
    coordinates = Coordinates(model, record.known_stiffness(), shown, middle)

    seed = (settings.seed, record.first_index)
    sampler = _sampler(job)
    if job.archive is not None:
        archive = coordinates.coordinates(job.archive)
    else:
        sampler, archive = coordinates.cold(np.random.default_rng((*seed, 3)), sampler)
    sampled = dream.sample(
        np.random.default_rng((*seed, 0)),
        coordinates.density(likelihood),
        coordinates.lower,
        coordinates.upper,
        evaluations=job.evaluations,
        settings=sampler,
        archive=archive,
        stop=_stop(job, expired),
    )
    chains = coordinates.chains(sampled)
    posterior = chains.posterior()
    # R-hat and ESS cost more than the sampling if all draws are ranked.
    thin = max(1, len(chains.kept) // DIAGNOSED)
    rhat, ess = convergence.rhat_and_ess(chains.kept[::thin])
    summary = moments(posterior, *model.bounds)
    residual = (record.measured - fitting.simulate(model, chains.best[None], record)[0])[settle:]
    rms = float(residual.std())
    draws = posterior[_spread(len(posterior), settings.draws)]
    frozen = Frozen(
        number=job.window.number,
        segment=job.window.segment,
        start=job.window.end + round(settings.time_budget / record.period),
        stop=job.window.end + round((settings.time_budget + settings.hop) / record.period),
        model=model,
        draws=draws,
        residual=fit_residual(residual, parameters=len(model.names)),
        noise=noise,
    )
    return WindowResult(
        window=job.window,
        settings=settings,
        model=model,
        moments=summary,
        prior_dominated=tuple(bool(f) for f in summary.prior_dominated),
        best=chains.best,
        rhat=rhat,
        ess=ess,
        rms_error=rms,
        nrmse=rms / float(record.measured[settle:].std()),
        noise=noise,
        evaluations=chains.evaluations,
        stopped_early=chains.evaluations + sampler.chains <= job.evaluations,
        converged=bool(chains.annealed and rhat.max() <= settings.rhat_limit),
        response=response_band(draws, record.known_stiffness(), settings),
        scored=tuple(p for old in job.frozen for p in _score(job, old, seed)),
        forecast=tuple(_forecast(job, frozen, seed)),
        frozen=frozen,
        archive=_archive(chains.archive, job.archive),
    )


def _stop(job: Job, expired: Callable[[], bool] | None) -> Callable[[dream.State], bool] | None:
    """What ends the sampling early: the evaluations of the run that is repeated, or the clock."""
    if job.stop_at is not None:
        at = job.stop_at
        return lambda state: state.evaluations >= at
    return None if expired is None else lambda _: expired()


def _sampler(job: Job) -> dream.Settings:
    """Settings of the sampler."""
    warm = job.archive is not None
    sampler = dream.Settings(chains=job.chains, adaptation=ADAPT if warm else 50)
    if not (warm and job.model.effects):
        return sampler
    # A warm start takes a quarter of the population, and moves a chain of so many sweeps each:
    # batches are full.
    return replace(sampler, population=4 * sampler.sweeps * job.chains)


def _archive(new: Array, old: Array | None) -> Array:
    """Points for the next window; few of them, of a window cut short, are joined by older ones."""
    if old is None or len(new) >= ARCHIVE:
        return new
    return np.concatenate([new, old[_spread(len(old), ARCHIVE - len(new))]])


def _check_excited(record: Record, settle: int, noise: float) -> None:
    moved = float(record.command[settle:].std())
    if moved <= EXCITATION * noise or moved == 0.0 or float(record.measured[settle:].std()) == 0.0:
        raise InputError(
            f'nothing moves: the command varies by {moved * 1e6:.3g} um rms, the sensor noise is '
            f'{noise * 1e6:.3g} um; the window calibrates nothing and is left out'
        )


def _spread(count: int, wanted: int) -> NDArray[np.intp]:
    return np.linspace(0, count - 1, min(count, wanted)).astype(np.intp)


def _score(job: Job, old: Frozen, seed: tuple[int, int]) -> list[Prediction]:
    """Hold an earlier posterior against the samples of this window that it forecast."""
    record = job.window.record
    start, stop = old.start - record.first_index, old.stop - record.first_index
    return predictions(
        old,
        _respond(job, old, record, start, stop),
        stamp_ns=record.stamp_ns(start),
        period=record.period,
        levels=job.settings.levels,
        seed=(*seed, 1, old.number),
        measured=record.measured[start:stop],
    )


def _respond(job: Job, frozen: Frozen, record: Record, start: int, stop: int) -> Array:
    """Response of frozen draws over start:stop, its initial state forgotten, shape (m, n) [m]."""
    settle = round(job.settings.settle / record.period)
    # Eq. (2) forgets; an effect may remember the whole window (yield, drift).
    begin = 0 if frozen.model.effects or settle == 0 else max(0, start - 2 * settle)
    part = record.slice(begin, stop)
    return fitting.simulate(frozen.model, frozen.draws, part, start - begin)


def _forecast(job: Job, frozen: Frozen, seed: tuple[int, int]) -> list[Prediction]:
    """Bands over the samples to come, as far as all their commands are known."""
    record, ahead = job.window.record, job.ahead
    beyond = frozen.stop - job.window.end
    if ahead is None or len(ahead) < beyond:
        return []
    longer = replace(
        record,
        command=np.concatenate([record.command, ahead[:beyond]]),
        # Only the first measured samples are used, for the initial state.
        measured=np.concatenate([record.measured, np.full(beyond, record.measured[-1])]),
        force=None,
    )
    start = frozen.start - record.first_index
    return predictions(
        frozen,
        _respond(job, frozen, longer, start, len(longer)),
        stamp_ns=record.stamp_ns(start),
        period=record.period,
        levels=job.settings.levels,
        seed=(*seed, 2, frozen.number),
    )
