"""One window's work as pure functions, which run in any process or thread: job in, result out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.choice import ModelChoice
from actuator_glue.inference.convergence import rhat_and_ess
from actuator_glue.inference.moments import Moments, moments
from actuator_glue.inference.posterior import NoPosteriorError
from actuator_glue.inference.prior_conflict import Conflict
from actuator_glue.online import fitting, window_posterior
from actuator_glue.online.forecast import FrozenPosterior, WindowPrediction, predictions
from actuator_glue.online.response import ResponseBand, response_band
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Window
from actuator_glue.online.structures import pooled
from actuator_glue.online.window_posterior import Job, WindowFit
from actuator_glue.records import Array

# A function that tells whether the time budget is spent.
Expired: TypeAlias = Callable[[], bool]
# Draws whose mean response is the forecast by which a structure's weight is judged.
_FEW = 32
# Generations that R-hat and ESS are computed from.
DIAGNOSED = 150


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
        shaping_factor: G of Eq. (4) the window was sampled with; NaN for a formal likelihood.
        noise: standard deviation of the sensor noise [m].
        evaluations: likelihood evaluations done.
        stopped_early: the time budget ended the sampling.
        converged: largest R-hat is at or below its limit.
        response: frequency-response band.
        scored: bands of earlier posteriors over samples of this window, with their coverage.
        forecast: bands over samples to come, where their command is known.
        frozen: the posterior, whose forecast later samples will judge.
        archive: points for the next window to start from.
        learned: the posterior, for the priors of later windows.
        conflict: how far the window contradicts its prior.
        failure: why there is no posterior; empty where there is one.
        starved: the sampling ended before it had reached the posterior.
        rivals: fits of the other structures carried: the posteriors they forecast with.
        errors: as in `WindowFit`.
        structures: effects of each structure that the numbers above are a mixture of, the
            likeliest first, which is `model`.
        weights: their weights, fixed before the window.
        spent: likelihood evaluations of the likeliest structure, then of each other one (0 without
            a new result since the window before), last of Eq. (2) if it is only a reference.
        parts: model and moments of each structure by itself; None for one without a posterior yet.
        draws: some draws of the mixture, shape (m, p): where one structure is carried, those that
            the next window starts from.
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
    shaping_factor: float = float('nan')
    noise: float = 0.0
    evaluations: int = 0
    stopped_early: bool = False
    converged: bool = False
    response: ResponseBand | None = None
    scored: tuple[WindowPrediction, ...] = ()
    forecast: tuple[WindowPrediction, ...] = ()
    frozen: FrozenPosterior | None = None
    archive: Array | None = None
    learned: Carried | None = None
    conflict: Conflict | None = None
    failure: str = ''
    starved: bool = False
    rivals: tuple[WindowFit, ...] = ()
    errors: tuple[float, ...] = ()
    structures: tuple[tuple[str, ...], ...] = ()
    weights: tuple[float, ...] = ()
    spent: tuple[int, ...] = ()
    parts: tuple[tuple[ModelChoice, Moments] | None, ...] = ()
    draws: Array | None = None


def run(job: Job, expired: Expired | None = None) -> WindowResult:
    """Estimate one window.

    The result depends on the job alone, unless `expired` ends the sampling; the result then says
    so and how many evaluations were done, and a job with that `stop_at` repeats it.

    Args:
        job: what to compute.
        expired: tells whether the time budget is spent; None never stops early.
    """
    return report(job, fit(job, expired))


def fit(job: Job, expired: Expired | None = None) -> WindowFit:
    """Do the first part of `run`, all that the next job needs; a window may fail.

    The likeliest structure is sampled. The others, which `renew` samples beside, forecast with
    their last posteriors.
    """
    leading = _fit(job, expired)
    if leading.failure or not job.rivals:
        return leading
    assert leading.frozen is not None
    rivals = tuple(
        WindowFit(
            job.window,
            one.model,
            frozen=window_posterior.stands(one),
            failure='it is sampled beside',
            evaluations=one.renewed,
        )
        for one in job.rivals
    )
    beside = tuple(one.frozen for one in rivals if one.frozen is not None)
    return replace(
        leading,
        rivals=rivals,
        frozen=replace(leading.frozen, beside=beside),
        errors=_errors(job),
    )


def renew(job: Job) -> WindowFit:
    """Sample a window with one of the other structures, beside the likeliest one.

    No clock ends it: the result is the same whenever it comes. Chains that have not reached their
    posterior make no forecast.
    """
    fitted = _fit(job, None)
    chains = fitted.chains
    if chains is None:
        return replace(fitted, evaluations=1)
    return replace(
        fitted,
        chains=None,
        frozen=fitted.frozen if chains.annealed else None,
        evaluations=chains.evaluations,
    )


def _fit(job: Job, expired: Expired | None) -> WindowFit:
    try:
        return window_posterior.fit(job, expired)
    except InputError as error:
        starved = isinstance(error, NoPosteriorError)
        return WindowFit(job.window, job.model, failure=str(error), starved=starved)


def _errors(job: Job) -> tuple[float, ...]:
    """Return the mean square error of each structure's forecasts over a window's samples [m^2].

    NaN for a structure that made none; empty where there was no forecast.
    """
    record, models = job.window.recent, [one.model for one in (job, *job.rivals)]
    squares = np.full((len(job.frozen), len(models)), np.nan)
    for row, old in zip(squares, job.frozen, strict=True):
        own = {part.model: part for part in (old, *old.beside)}
        end, start, stop = (i - record.first_index for i in (old.end, old.start, old.stop))
        for j, part in enumerate(map(own.get, models)):
            if part is None:
                continue
            few = replace(part, draws=part.draws[window_posterior.spread(len(part.draws), _FEW)])
            middle = _respond(few, record.command[end:stop]).mean(axis=0)
            row[j] = np.mean((record.measured[start:stop] - middle) ** 2)
    # Of one forecast only, the latest: errors of the same samples can be compared.
    whole = squares[~np.isnan(squares).all(axis=1)]
    if not len(whole):
        return ()
    return tuple(whole[-1].tolist())


def report(job: Job, fitted: WindowFit, limits: bool = True) -> WindowResult:
    """Do the second part of `run`: what is published of a posterior.

    Args:
        job: what was computed.
        fitted: its first part.
        limits: whether the limits of bands, response and forecast are wanted; otherwise the
            result holds the bands' scores only.
    """
    try:
        return _report(job, fitted, limits)
    except InputError as error:
        return _failed(job, fitted, str(error))


def _failed(job: Job, fitted: WindowFit, reason: str) -> WindowResult:
    """Return the result of a failed window, with what later windows need."""
    return WindowResult(
        job.window,
        job.settings,
        job.model,
        frozen=fitted.frozen,
        archive=fitted.archive,
        learned=fitted.learned,
        conflict=fitted.conflict,
        failure=reason,
        starved=fitted.starved,
        rivals=fitted.rivals,
        errors=fitted.errors,
    )


def _report(job: Job, fitted: WindowFit, limits: bool) -> WindowResult:
    settings, model, record = job.settings, job.model, job.window.record
    chains, frozen = fitted.chains, fitted.frozen
    if chains is None or frozen is None:
        return _failed(job, fitted, fitted.failure)
    # R-hat and ESS of very many draws would cost more than the sampling.
    rhat, ess = rhat_and_ess(chains.kept[:: max(1, len(chains.kept) // DIAGNOSED)])
    each = _each(job, fitted, chains)
    posterior = _mixed(job, each)
    summary = moments(posterior, *model.bounds)
    drawn = posterior[window_posterior.spread(len(posterior), settings.draws)]
    scored = [p for old in job.frozen for p in _score(job, old)]
    if not limits:
        scored = [replace(p, band=p.band.slice(0, 0)) for p in scored]
    return WindowResult(
        window=job.window,
        settings=settings,
        model=model,
        moments=summary,
        prior_dominated=tuple(bool(f) for f in summary.prior_dominated),
        best=chains.best,
        rhat=rhat,
        ess=ess,
        rms_error=fitted.rms_error,
        nrmse=fitted.nrmse,
        shaping_factor=fitted.shaping_factor,
        noise=frozen.noise,
        evaluations=chains.evaluations,
        stopped_early=not fitted.complete,
        converged=bool(chains.annealed and rhat.max() <= settings.rhat_limit),
        response=(response_band(drawn, record.known_stiffness(), settings) if limits else None),
        scored=tuple(scored),
        forecast=tuple(_forecast(job, frozen)) if limits else (),
        frozen=frozen,
        archive=fitted.archive,
        learned=fitted.learned,
        conflict=fitted.conflict,
        rivals=fitted.rivals,
        errors=fitted.errors,
        structures=tuple(one.model.effects for one, _ in each),
        weights=tuple(one.weight for one, _ in each),
        spent=(chains.evaluations, *(one.evaluations for one in fitted.rivals)),
        parts=tuple(
            None if draws is None else (one.model, moments(draws, *one.model.bounds))
            for one, draws in each
        ),
        draws=posterior[window_posterior.spread(len(posterior), window_posterior.ARCHIVE)],
    )


def _each(job: Job, fitted: WindowFit, chains: Chains) -> list[tuple[Job, Array | None]]:
    """Return each structure of positive weight, with draws (m, p); None before it has any."""
    found: list[tuple[Job, Array | None]] = [(job, chains.posterior())]
    for rival, one in zip(job.rivals, fitted.rivals, strict=True):
        if rival.weight == 0.0:
            continue
        found.append((rival, None if one.frozen is None else one.frozen.draws))
    return found


def _mixed(job: Job, each: Sequence[tuple[Job, Array | None]]) -> Array:
    """Return draws (m, p) of all structures, mixed by their weights."""
    parts = [(one.weight, one.model.names, draws) for one, draws in each if draws is not None]
    rng = np.random.default_rng((job.settings.seed, job.window.record.first_index, 3))
    return pooled(job.model.names, parts, rng)


def _score(job: Job, old: FrozenPosterior) -> list[WindowPrediction]:
    """Compare an earlier posterior's forecast with its samples, which this window holds."""
    record = job.window.recent
    end, start, stop = (i - record.first_index for i in (old.end, old.start, old.stop))
    return predictions(
        old,
        [_respond(part, record.command[end:stop]) for part in old.parts],
        levels=job.settings.levels,
        seed=job.settings.seed,
        measured=record.measured[start:stop],
    )


def _forecast(job: Job, frozen: FrozenPosterior) -> list[WindowPrediction]:
    """Bands over the samples to come, where their commands are known."""
    if job.ahead is None:
        return []
    return predictions(
        frozen,
        [_respond(part, job.ahead) for part in frozen.parts],
        levels=job.settings.levels,
        seed=job.settings.seed,
    )


def _respond(frozen: FrozenPosterior, ahead: Array) -> Array:
    """Response of frozen draws over their forecast, shape (m, n) [m].

    Args:
        frozen: the posterior.
        ahead: commands from its window's end to its forecast's [m].
    """
    past = frozen.past
    longer = replace(
        past,
        command=np.concatenate([past.command, ahead]),
        # Only the first measured samples are used, for the initial state.
        measured=np.concatenate([past.measured, np.full(len(ahead), past.measured[-1])]),
        force=None,
    )
    return fitting.simulate(frozen.model, frozen.draws, longer, frozen.start - past.first_index)
