"""The shaping factors of a calibration: given, or from the residual of its own best fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from actuator_glue.api.calibration_options import CalibrationOptions
from actuator_glue.diagnosis.samples.force import with_forces
from actuator_glue.inference.chains import Chains
from actuator_glue.inference.effective_size import effective_size
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import Fit, fit
from actuator_glue.inference.posterior import Problem, Target, sample
from actuator_glue.inference.settings import SamplerSettings
from actuator_glue.model.effects import scale
from actuator_glue.model.exact import settle_samples
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

# Refits of displacement and force, each weighed as its error was before.
_WEIGHINGS = 3
# Logarithm of a shaping factor within which another one changes next to nothing.
_SAME = 0.1
# Draws of an earlier posterior from which a new one starts.
_ARCHIVE = 400


def sampled(
    problem: Problem,
    options: CalibrationOptions,
    near: Array,
    progress: Callable[[float], None],
) -> tuple[Problem, Target, Chains, tuple[str, ...]]:
    """Return a problem with its shaping factors, its posterior, and what automatic ones say.

    Least squares get stuck beside the best fit of effects that have kinks, where the residual
    holds more than noise and its posterior is too wide. So with effects the residual of the best
    draw is asked again; where it is worth another number of samples the posterior is drawn again.

    Args:
        problem: what is calibrated.
        options: how.
        near: parameters of Eq. (2) near their best fit, (4,).
        progress: called with the evaluations made so far in a run.

    Raises:
        InputError: settle too long, a residual without spread, or an impossible run.
    """
    ask = options.likelihood == 'glue' and options.shaping_factor == 'auto'
    problem = automatic(problem, near, options.use_force) if ask else _given(problem, options)
    target, chains = _run(problem, options, None, progress)
    if ask and chains.annealed and problem.model.effects:
        again = automatic(problem, chains.best, options.use_force)
        if not _same(problem, again):
            problem = again
            target, more = _run(problem, options, chains, progress)
            chains = replace(more, evaluations=chains.evaluations + more.evaluations)
    return problem, target, chains, _told(problem) if ask else ()


def _run(
    problem: Problem,
    options: CalibrationOptions,
    before: Chains | None,
    progress: Callable[[float], None],
) -> tuple[Target, Chains]:
    """Return the target and its draws, perhaps from where an earlier posterior stands."""
    target, archive = problem.target(), None
    published = SamplerSettings.published() if options.sampler == 'published' else None
    if before is not None and published is None:
        archive = before.posterior()[:: max(1, len(before.posterior()) // _ARCHIVE)]
        if target.transform is not None:
            archive = target.transform.forward(np.ascontiguousarray(archive))
    chains = sample(
        target,
        (options.seed,) if before is None else (options.seed, 1),
        options.evaluations,
        settings=published,
        archive=archive,
        progress=lambda made, _: progress(made),
    )
    return target, chains


def _given(problem: Problem, options: CalibrationOptions) -> Problem:
    """Return a problem with the factors that the options fix."""
    g = options.shaping_factor
    if options.likelihood != 'glue' or g == 'auto':
        g = 0.5 * sum(len(r) - round(problem.settle / r.period) for r in problem.records)
    return replace(problem, shaping_factor=g, force=g if options.use_force else None)


def _same(one: Problem, other: Problem) -> bool:
    pairs = [(one.shaping_factor, other.shaping_factor)]
    if one.force is not None and other.force is not None:
        pairs.append((one.force, other.force))
    return all(abs(np.log(a / b)) < _SAME for a, b in pairs)


def _told(problem: Problem) -> tuple[str, ...]:
    """Return what automatic factors say of the records, for people."""
    g, samples = problem.shaping_factor, sum(map(len, problem.records))
    told = (
        f'the residual of {samples} samples is worth {2.0 * g:.0f} independent ones by its '
        f'autocorrelation: G = {g:.6g}'
    )
    if problem.force is not None:
        told += f'; that of the force {2.0 * problem.force:.0f}'
    return (told,)


def automatic(problem: Problem, theta: Array, use_force: bool = False) -> Problem:
    """Return a problem with half the samples that the residual of its best fit is worth as G.

    Args:
        problem: what is calibrated.
        theta: parameters near the best fit, of Eq. (2) (4,) or of the whole model (p,).
        use_force: the forces are fitted, too, and have a G of their own.

    Raises:
        InputError: settle too long, or a residual without spread.
    """
    data = Data.whole(problem.records)
    counts = [round(problem.settle / r.period) for r in data.records]
    for mask, count in zip(data.masks, settle_samples(data.records, counts), strict=True):
        mask[:count] = False
    data = replace(data, initials=(problem.initial,) * len(data.records))
    effects = problem.model.effects
    model = Structure(effects)
    found = fit(data, model, theta) if len(theta) > 4 else _best(data, effects, theta)
    if not use_force:
        return replace(problem, shaping_factor=_half(data, found, slice(None)))
    both = data
    for _ in range(_WEIGHINGS):
        both = with_forces(data, model, found.theta)
        found = fit(both, model, found.theta)
    count = len(data.records)
    return replace(
        problem,
        shaping_factor=_half(both, found, slice(count)),
        force=_half(both, found, slice(count, None)),
    )


def _half(data: Data, found: Fit, which: slice) -> float:
    """Return half of what the residual of some of the records is worth."""
    parts = data.parts[which]
    rows = zip(data.records[which], data.masks[which], strict=True)
    return 0.5 * effective_size(
        [found.error[part] for part in parts],
        [found.jacobian_of(part) for part in parts],
        [(record.command[mask], record.measured[mask]) for record, mask in rows],
    )


def _best(data: Data, effects: Sequence[str], theta: Array) -> Fit:
    """Return the least-squares fit, reached by one effect after the other."""
    found = fit(data, Structure(()), theta)
    for number in range(1, len(effects) + 1):
        model = Structure(effects[:number])
        starts = model.starts(found.theta[:4], scale(data.records, found.theta))
        starts[:, : len(found.theta)] = found.theta
        neutral = model.neutral(found.theta[:4])
        neutral[: len(found.theta)] = found.theta
        found = fit(data, model, np.vstack([neutral, starts]))
    return found
