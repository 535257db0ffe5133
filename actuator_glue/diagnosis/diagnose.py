"""Decide whether Eq. (2) is enough for given records and, if not, which effect it lacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from actuator_glue.diagnosis import (
    advice,
    homogeneity,
    learned_term,
    per_record_settings,
    posterior,
    verdict,
)
from actuator_glue.diagnosis.completeness import Decision
from actuator_glue.diagnosis.detect import alarm_of
from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Candidate, Finding
from actuator_glue.diagnosis.fit import Space
from actuator_glue.diagnosis.homogeneity import Homogeneity
from actuator_glue.diagnosis.measurement import Measured
from actuator_glue.diagnosis.model_selection import Selection
from actuator_glue.diagnosis.pipeline import (
    Progress,
    conclude,
    with_learned_terms,
    with_the_right_hold,
)
from actuator_glue.diagnosis.preparation import prepare
from actuator_glue.diagnosis.ranking import standard_error, weights
from actuator_glue.diagnosis.result import DiagnosisData
from actuator_glue.diagnosis.search import Each, Trial
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.verify import Side, traces, verify
from actuator_glue.inference.at_bound import Pressed, pressed
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Record

Clock = Callable[[], float]


def diagnose(
    records: Sequence[Record],
    holdout: Sequence[Record] | Record | None = None,
    *,
    seed: int = 0,
    each: Each = map,
    progress: Progress | None = None,
    settings: Thresholds | None = None,
    clock: Clock | None = None,
) -> DiagnosisData:
    """Diagnose records whose specimen stiffness is known.

    Args:
        records: fitting records of one actuator.
        holdout: record(s) that decide nothing and give the error before and after; without
            one, a quarter of each record is set aside in blocks before any look.
        seed: seed of every random step; the same seed gives the same diagnosis.
        each: refits candidates: `map`, or that of a pool of threads, which is as good.
        progress: called with (stage, share done in [0, 1]).
        settings: thresholds.
        clock: gives seconds, for the duration reported (NaN without one).

    Raises:
        InputError: stiffness not known, records too short, or nothing moves.
    """
    start = clock() if clock else math.nan
    settings = settings or Thresholds()
    tell = progress or (lambda stage, share: None)
    held = [holdout] if isinstance(holdout, Record) else list(holdout or ())
    tell('check', 0.0)
    first = conclude(prepare(records, held), settings, each, tell)
    result = with_learned_terms(with_the_right_hold(first, settings, each, tell))
    prepared, data, scorer = result.prepared, result.data, result.scorer
    found, decision = result.found, result.decision
    stretches = homogeneity.agreement(decision.final, scorer)
    rng = np.random.default_rng([seed, 1])
    sides: list[Side] = []
    for stage, trial in (('posterior before', found.base), ('posterior', decision.final)):
        if sides and not decision.final.effects:
            sides.append(sides[0])
            break
        draws, rhat = posterior.sample(
            data,
            trial.model,
            trial.fit,
            scorer,
            rng=rng,
            evaluations=settings.evaluations if trial.effects else 0,
            progress=partial(tell, stage),
        )
        sides.append(Side(trial.model, trial.fit.theta, draws))
    before, after = sides
    tell('held-out', 0.0)
    error, coverage, curves = verify(
        data, prepared.held, before, after, decision.noise, seed, result.line, len(found.singles)
    )
    space = Space(after.model, max(r.duration for r in data.records))
    estimates, held_at = _estimates(space, after), _pressed(space, after)
    effects = _findings(decision, found, estimates, stretches)
    learned = learned_term.described(decision.final, data, estimates)
    moved = any(e.noise is None for e in effects)
    judged = verdict.conclude(decision.verdict, moved, error, found.material)
    tell('done', 1.0)
    return DiagnosisData(
        verdict=judged,
        effects=effects,
        error=error,
        candidates=_candidates(found, result.seen),
        coverage=coverage,
        alarm=alarm_of(found, result.seen, decision, data, seed, settings.false_alarms),
        advice=(
            *advice.at_bound(held_at, estimates),
            *(term.sentence() for term in learned),
            *advice.of(decision, found, result.generic, stretches),
            *advice.contradicted(error, found.material),
            *advice.unidentified(data, estimates),
            *advice.unconverged(rhat),
            *prepared.notes,
        ),
        base={p.name: estimates[p.name] for p in BASE},
        structure=decision.final.effects,
        learned=learned,
        names=tuple(p.name for p in after.model.parameters),
        posterior=after.draws,
        rhat=rhat,
        best=after.theta,
        traces=(
            *traces(prepared.fit, False, curves),
            *traces(prepared.held, True, curves),
        ),
        surrogate=result.generic.to_json(),
        remaining=decision.remaining,
        seconds=clock() - start if clock else math.nan,
        at_bound=held_at,
        sampling=tuple(
            {
                'source': r.source,
                'rate_hz': whole.rate,
                'fitted_rate_hz': r.rate,
                'impulse_samples': impulses,
            }
            for r, whole, impulses in zip(
                prepared.fit.records, prepared.fit.recorded, prepared.impulses, strict=True
            )
        ),
    )


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


def _estimates(space: Space, side: Side) -> dict[str, Estimate]:
    out = {}
    lower, upper = space.theta(space.lower), space.theta(space.upper)
    known = posterior.identified(space, side.draws)
    for i, (parameter, column) in enumerate(zip(side.model.parameters, side.draws.T, strict=True)):
        low, high = np.quantile(column, [0.025, 0.975])
        out[parameter.name] = Estimate(
            float(column.mean()), float(column.std(ddof=1)), float(low), float(high),
            parameter.unit, parameter.neutral, bool(known[i]), (float(lower[i]), float(upper[i])),
        )  # fmt: skip
    return out


def _measured_estimates(effect: Measured) -> dict[str, Estimate]:
    rows = zip(CATALOGUE[effect.name].parameters, effect.values, effect.stddev, strict=True)
    return {
        p.name: Estimate(v, s, v - 1.96 * s, v + 1.96 * s, p.unit, p.neutral) for p, v, s in rows
    }


def _findings(
    decision: Decision,
    found: Selection,
    estimates: dict[str, Estimate],
    stretches: dict[str, Homogeneity],
) -> tuple[Finding, ...]:
    out = []
    entries = {e.name: e for e in decision.final.structure.entries}
    for name in decision.names:
        described = learned_term.is_learned(entries[name])
        # A learned term describes; there is no cause by its name that might be true.
        rivals = tuple(
            replace(r, probability=decision.certainty * r.probability) for r in found.rivals[name]
        )
        tied = [r for r in rivals if r.tied]
        own = {p.name: estimates[p.name] for p in entries[name].parameters}
        first = next(iter(own.values()))
        gained = found.removed[name]
        out.append(
            Finding(
                name=name,
                alternatives=tuple(r.name for r in tied if r.name != name),
                probability=math.nan
                if described
                else next(r.probability for r in rivals if r.name == name),
                place=entries[name].place,
                parameters=own,
                error_without=float(np.sqrt(found.final.mean_square + gained**2)),
                error_with=found.final.fit.rms,
                evidence=found.evidence[name],
                plausible=_excludes_neutral(first),
                agrees_across_windows=stretches[name].agree,
                windows=stretches[name].values,
                records=_records_of(decision.final, name),
                rivals=() if described else rivals,
            )
        )
    for effect in decision.measured:
        total = float(np.sqrt(found.final.mean_square))
        out.append(
            Finding(
                name=effect.name,
                alternatives=(),
                probability=math.nan,
                place=CATALOGUE[effect.name].place,
                parameters=_measured_estimates(effect),
                error_without=total,
                error_with=total,
                evidence=effect.nats,
                noise=effect.rms,
            )
        )
    return tuple(
        sorted(out, key=lambda f: f.error_with**2 - f.error_without**2 - (f.noise or 0.0) ** 2)
    )


def _records_of(trial: Trial, name: str) -> tuple[str, ...]:
    """Records that alone have an effect; none where all have it."""
    if not isinstance(trial.own, per_record_settings.OneRecord) or trial.own.own != name:
        return ()
    return (trial.own.records[0].source or 'one record',)


def _excludes_neutral(estimate: Estimate) -> bool:
    if estimate.neutral is None:
        return True
    return not estimate.lower <= estimate.neutral <= estimate.upper


def _candidates(found: Selection, seen: tuple[Measured, ...]) -> tuple[Candidate, ...]:
    base = found.base.scores
    known = weights(np.stack([*(t.scores for t in found.singles), base]))
    rows = [
        Candidate(
            t.added, float((t.scores - base).sum()), t.fit.rms, float(w),
            standard_error(t.scores - base),
        )
        for t, w in zip(found.singles, known, strict=False)
    ]  # fmt: skip
    base_rms = found.base.fit.rms
    rows += [
        Candidate(m.name, m.nats, float(np.sqrt(max(0.0, base_rms**2 - m.rms**2))), math.nan)
        for m in seen
    ]
    return tuple(sorted(rows, key=lambda c: c.error))
