"""Decide whether Eq. (2) is enough for given records and, if not, which effect it lacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis import (
    advice,
    agreement,
    companions,
    discrepancy,
    held_out_reach,
    model_form,
    posterior,
    response,
    ridge,
    table,
    told_effects,
    verdict,
    wrong_setup,
)
from actuator_glue.diagnosis.alternatives import alternatives
from actuator_glue.diagnosis.conclusion import Conclusion
from actuator_glue.diagnosis.detect import alarm_of
from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.first_look import FirstLook
from actuator_glue.diagnosis.force import check_forces
from actuator_glue.diagnosis.held_out import COMPLETE
from actuator_glue.diagnosis.held_out_look import Side, traces, verify
from actuator_glue.diagnosis.learned import term as learned_term
from actuator_glue.diagnosis.mixed_draws import MixedDraws, mixed
from actuator_glue.diagnosis.next_experiment import Experiment, ranked
from actuator_glue.diagnosis.pipeline import as_given, conclude
from actuator_glue.diagnosis.preparation import prepare
from actuator_glue.diagnosis.result import DiagnosisData
from actuator_glue.diagnosis.stages import Progress, Stage
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.hygiene import rest
from actuator_glue.hygiene.clean import rest_samples
from actuator_glue.inference.at_bound import Pressed, pressed
from actuator_glue.inference.least_squares.base_prior import BasePrior
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import base_fit
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import UPPER, Space
from actuator_glue.inference.prior_use import GivenPrior
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array, Record

# Draws that are run with sines: the ends of an interval over 32 of them leave out 11 %, not 5 %.
_RESPONSES = 400


def diagnose(
    records: Sequence[Record],
    holdout: Sequence[Record] | Record | None = None,
    *,
    seed: int = 0,
    each: Each = map,
    progress: Progress | None = None,
    first_look: Callable[[FirstLook], None] | None = None,
    settings: Thresholds | None = None,
    prior: GivenPrior | None = None,
) -> DiagnosisData:
    """Diagnose records whose specimen stiffness is known.

    Args:
        records: fitting records of one actuator.
        holdout: record(s) that decide nothing and give the error before and after; without
            one, a quarter of each record is set aside in blocks before any look.
        seed: seed of every random step; the same seed gives the same diagnosis.
        each: refits candidates and evaluates draws: `map`, or that of a pool of threads.
        progress: called with (stage, share done in [0, 1]).
        first_look: called once, seconds after the start, with what Eq. (2) leaves.
        settings: thresholds.
        prior: what an earlier calibration knew of Eq. (2)'s parameters.

    Raises:
        InputError: stiffness not known, records too short, or nothing moves.
    """
    settings = settings or Thresholds()
    tell = progress or (lambda stage, share: None)
    held = [holdout] if isinstance(holdout, Record) else list(holdout or ())
    tell('check', 0.0)
    known = None if prior is None else BasePrior(prior.carried, UPPER)
    if settings.use_force:
        check_forces(records)
    ready = prepare(records, held, known)
    effort = Effort(settings.effort)
    some = wrong_setup.stretched(ready.fit)
    given = base_fit(some)
    if first_look is not None:
        first_look(FirstLook.of(some, given, settings))
    other = wrong_setup.find(ready.fit, settings, given=given)
    if other is not None and other.enough:
        # What a wrong set-up leaves is nothing that the actuator does.
        result = as_given(ready, settings, each, tell, effort)
    else:
        result = conclude(ready, settings, each, tell, effort)
    prepared, data, scorer = result.prepared, result.data, result.scorer
    found, decision = result.found, result.decision
    stretches = agreement.agreement(decision.final, scorer)
    rng = np.random.default_rng([seed, 1])
    size = max(found.material, decision.left)
    # One record's own setting is told from a common one by size alone: no common one beside it.
    own = decision.final.own is not None
    small = {} if own else discrepancy.responses(result.selection.search, size)

    def sample(trial: Trial, evaluations: int = 0, stage: Stage = 'posterior') -> posterior.Draws:
        finer = trial.own is None and not trial.structure.linear
        return posterior.sample(
            trial.model,
            trial.fit,
            replace(scorer, data=replace(scorer.data, finer=finer)),
            beside=discrepancy.beside(small, trial.effects, scorer),
            rng=rng,
            evaluations=evaluations,
            progress=partial(tell, stage),
            each=each,
        )

    final = decision.final
    draws = sample(found.base, stage='posterior before')
    before = after = Side(found.base.model, found.base.fit.theta, draws.points)
    if final.effects:
        draws = sample(final, settings.evaluations)
        after = Side(final.model, final.fit.theta, draws.points)
    still = [
        rest.noise_at_rest(r, rest_samples(r), initial)
        for r, initial in zip(data.records, data.initials, strict=True)
    ]
    tell('held-out', 0.0)
    error, coverage, curves = verify(
        data, prepared.held, before, after, decision.noise, seed, result.line, len(found.singles)
    )
    space = Space(after.model, data.duration)
    open_ridge = ridge.left_open(space, after.model, scorer, after.theta)
    others = alternatives(result)
    larger = final
    if decision.verdict in COMPLETE and not effort.over:
        larger = companions.with_companions(result.selection, final)
    told, mixture = draws, MixedDraws.of(draws.points, final.effects)
    # Chains that met nowhere give no interval that anything beside, or in place, could widen.
    nowhere = bool(draws.unmet) and all(draws.unmet)
    if larger is not final and not nowhere:
        known_alone = posterior.identified(space, draws.points, open_ridge).tolist()
        told = sample(larger, settings.evaluations)
        mixture = MixedDraws.of(told.points, larger.effects)
        if like := companions.alike(result.selection.search, final, larger):
            mixture = mixed(mixture, larger, like, lambda t: sample(t).points, rng)
        told = told._replace(points=mixture.points)
        told = companions.reduced(told, larger, final, known_alone)
        mixture = replace(mixture, points=told.points)
    if not nowhere:
        mixture = mixed(mixture, final, others, lambda t: sample(t).points, rng)
    spread = mixture.points
    error = held_out_reach.reached_by_both(
        error, found.material, scorer, prepared.held, before, after
    )
    judged = verdict.of_both_parts(decision.verdict, bool(decision.names), error, found.material)
    if other is not None and any(map(learned_term.is_learned, final.structure.entries)):
        # A description of what another set-up explains with none describes the set-up.
        judged = 'unexplained' if judged in COMPLETE else judged
    setup = result.prepared.setup or (None if judged in COMPLETE else other)
    if judged not in COMPLETE:
        search, left = result.selection.search, decision.left
        form = model_form.open_form(search, final, left, space, scorer)
        spread = model_form.widened(spread, form, space, rng)
    spread, fixed = posterior.opened(space, spread, open_ridge, told.unmet, rng)
    estimates = _estimates(space, after.model, spread, fixed)
    held_at = _pressed(space, after)
    plain = Space(before.model, data.duration)
    plain_ridge = ridge.left_open(plain, before.model, scorer, before.theta)
    estimates_before = _estimates(
        plain, before.model, *posterior.opened(plain, before.draws, plain_ridge, (), rng)
    )
    experiments = _experiments(result, [trial for trial, _ in others])
    sizes = result.selection.search.scale()
    decision = replace(
        decision, certainty=verdict.certainty(decision.certainty, error, found.material)
    )
    effects = told_effects.of(decision, found, estimates, stretches)
    judged = verdict.named(judged, effects)
    learned = learned_term.described(decision.final, data, estimates)
    used = None
    if prior is not None and known is not None:
        p_value = known.conflict(after.draws).p_value
        used = prior.used(known.components, known.quality, p_value)
    contradicted = advice.contradicted(error, found.material)
    beside = companions.sentences(final, larger, prepared.held, bool(contradicted))
    if contradicted and not beside and decision.verdict in COMPLETE and not effort.over:
        beside = companions.hint(result.selection, final, prepared.held)
    tell('done', 1.0)
    return DiagnosisData(
        verdict=judged,
        effects=effects,
        error=error,
        candidates=told_effects.candidates(found, result.seen),
        coverage=coverage,
        alarm=alarm_of(found, result.seen, decision, data, seed, settings.false_alarms, each),
        advice=(
            *([used.contradiction()] if used and used.contradicted else []),
            *advice.at_bound(held_at, estimates),
            *([result.onset.sentence()] if result.onset else []),
            *advice.ended(effort),
            *(term.sentence() for term in learned),
            *advice.of(decision, found, result.generic, stretches, experiments),
            *contradicted,
            *advice.zeros(error, found.material),
            *beside,
            *advice.unidentified(data, estimates),
            *advice.unconverged(float(np.fmax(draws.rhat, told.rhat))),
            *rest.compared(data.records, still, decision.noise),
            *([used.remark()] if used else []),
            *prepared.told,
        ),
        base={p.name: estimates[p.name] for p in BASE},
        structure=decision.final.effects,
        learned=learned,
        base_before={n: e for n, e in estimates_before.items() if n in estimates},
        responses=tuple(
            response.of(
                after.model,
                after.theta,
                after.draws[:: max(len(after.draws) // _RESPONSES, 1)],
                sizes,
                k,
            )
            for k in sorted({r.known_stiffness() for r in data.records})
        ),
        experiments=experiments,
        onset=result.onset,
        prior=used,
        setup=setup,
        structures=table.rows(
            result.selection.search.left_at_most(math.inf), scorer, final.effects
        ),
        names=tuple(p.name for p in after.model.parameters),
        posterior=spread,
        which=mixture.which,
        mixture=mixture.structures,
        joint=after.draws,
        rhat=draws.rhat,
        sampler=draws.told(),
        best=after.theta,
        traces=(
            *traces(prepared.fit, False, curves),
            *traces(prepared.held, True, curves),
        ),
        history=result.history,
        surrogate=result.generic.to_json(),
        remaining=decision.remaining,
        at_bound=held_at,
        effort=effort.share,
        preparation=tuple(prepared.told),
        sampling=tuple(
            {
                'source': r.source,
                'rate_hz': whole.rate,
                'fitted_rate_hz': r.rate,
                'impulse_samples': len(impulses.samples),
                'noise_at_rest_m': noise,
            }
            for r, whole, impulses, noise in zip(
                prepared.fit.records, prepared.fit.recorded, prepared.impulses, still, strict=True
            )
        ),
    )


def _experiments(result: Conclusion, rivals: Sequence[Trial]) -> tuple[Experiment, ...]:
    """Rank tests by what they would tell about names that these records leave tied."""
    if not rivals:
        return ()
    final, search = result.decision.final, result.selection.search
    return ranked(final, rivals, result.scorer, search.scale(), result.decision.noise)


def _pressed(space: Space, side: Side) -> tuple[Pressed, ...]:
    """Return parameters that a bound holds, in physical units."""
    names = tuple(p.name for p in side.model.parameters)
    lower, upper = space.theta(space.lower), space.theta(space.upper)
    out = []
    for p in pressed(space.z(side.draws), names, space.lower, space.upper):
        i = names.index(p.name)
        bound = float((lower if p.side == 'lower' else upper)[i])
        # Eq. (2)'s parameters are positive: the least their logarithms reach stands for zero.
        physical = p.physical or (i < len(BASE) and p.side == 'lower')
        out.append(replace(p, bound=bound, physical=physical))
    return tuple(out)


def _estimates(
    space: Space, model: Model, draws: Array, known: NDArray[np.bool_]
) -> dict[str, Estimate]:
    """Return what draws (m, p) say of each parameter, and whether the records fix it (p,)."""
    lower, upper = space.theta(space.lower), space.theta(space.upper)
    ends = np.quantile(draws, [0.025, 0.975], axis=0)
    return {
        p.name: Estimate(
            float(draws[:, i].mean()), float(draws[:, i].std(ddof=1)),
            float(ends[0, i]), float(ends[1, i]),
            p.unit, p.neutral, bool(known[i]), (float(lower[i]), float(upper[i])),
        )
        for i, p in enumerate(model.parameters)
    }  # fmt: skip
