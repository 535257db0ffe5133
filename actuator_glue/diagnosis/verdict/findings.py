"""Findings of an answer: sizes, rivals, probabilities, errors with and without."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Candidate, Finding, Rival
from actuator_glue.diagnosis.learned import term as learned_term
from actuator_glue.diagnosis.learned.forms import CAUSES
from actuator_glue.diagnosis.measured.measurement import Measured
from actuator_glue.diagnosis.posterior.agreement import Homogeneity
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.diagnosis.score import reliability
from actuator_glue.diagnosis.score.scorer import standard_error
from actuator_glue.diagnosis.search.judge import Judge
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.model.effects import CATALOGUE


def _measured_estimates(effect: Measured) -> dict[str, Estimate]:
    rows = zip(CATALOGUE[effect.name].parameters, effect.values, effect.stddev, strict=True)
    return {
        p.name: Estimate(v, s, v - 1.96 * s, v + 1.96 * s, p.unit, p.neutral) for p, v, s in rows
    }


def of(
    found: Selection,
    seen: Sequence[Measured],
    certainty: float,
    estimates: dict[str, Estimate],
    stretches: dict[str, Homogeneity],
) -> tuple[Finding, ...]:
    """Return the additions with sizes, rivals and errors, most removed first.

    Args:
        found: what the fitting part says.
        seen: effects of the measurement.
        certainty: factor on the names' share of the weight, in [0, 1].
        estimates: of all parameters.
        stretches: sizes of each effect in halves of the records.
    """
    out = []
    for entry in found.final.structure.entries:
        name, described = entry.name, learned_term.is_learned(entry)
        # A learned term is a description: its name is no cause that might be true.
        own = {p.name: estimates[p.name] for p in entry.parameters}
        sizes = _how_much(tuple(own.values()))
        rivals = _told(found.rivals[name], certainty, sizes)
        tied = [r for r in rivals if r.tied]
        gained = found.removed[name]
        out.append(
            Finding(
                name=name,
                alternatives=tuple(r.name for r in tied if r.name != name),
                probability=math.nan
                if described
                else next(r.probability for r in rivals if r.name == name),
                place=entry.place,
                parameters=own,
                error_without=float(np.sqrt(found.final.mean_square + gained**2)),
                error_with=found.final.fit.rms,
                evidence=found.evidence[name],
                plausible=any(map(_excludes_neutral, sizes)),
                agrees_across_windows=stretches[name].agree,
                windows=stretches[name].values,
                records=_records_of(found.final, name),
                rivals=() if described else rivals,
                cause=_cause(name, rivals),
            )
        )
    for effect in seen:
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


def _cause(name: str, rivals: tuple[Rival, ...]) -> str:
    """Name the effect that a form is another shape of, if the nearest name is of its group."""
    named = [r for r in rivals if r.name in CATALOGUE]
    if name not in CAUSES or not named:
        return ''
    nearest = CATALOGUE[min(named, key=lambda r: r.excess).name]
    return CAUSES[name] if nearest.group == CATALOGUE[CAUSES[name]].group else ''


def _records_of(trial: Trial, name: str) -> tuple[str, ...]:
    """Records, held-out ones among them, that alone have an effect; none where all have it."""
    if not isinstance(trial.own, OneRecord) or trial.own.own != name:
        return ()
    return tuple(dict.fromkeys(r.source or 'one record' for r in trial.own.records))


def _told(
    rivals: Sequence[Rival], certainty: float, sizes: Sequence[Estimate]
) -> tuple[Rival, ...]:
    """Return rivals with their reported probabilities, which are calibrated together.

    A probability says no more than the interval of the size, which may include the neutral value.
    """
    weight = sum(r.probability for r in rivals)
    sure = max(map(reliability.sureness, sizes), default=1.0)
    known = reliability.calibrated(certainty * sure * weight) / weight
    return tuple(replace(r, probability=known * r.probability) for r in rivals)


def _how_much(sizes: Sequence[Estimate]) -> list[Estimate]:
    """Return the sizes that say how much there is of an effect; others shape it.

    They are the first one, and each whose neutral value is zero.
    """
    return [s for i, s in enumerate(sizes) if i == 0 or s.neutral == 0.0]


def _excludes_neutral(size: Estimate) -> bool:
    """Whether the interval of a size excludes the neutral value, if there is one."""
    return size.neutral is None or not size.lower <= size.neutral <= size.upper


def candidates(
    judge: Judge, found: Selection, seen: tuple[Measured, ...]
) -> tuple[Candidate, ...]:
    """Return every effect tried at the first turn and those of the measurement, best first.

    Args:
        judge: weighs structures.
        found: what the fitting part says.
        seen: effects of the measurement.
    """
    base, singles = found.base, found.singles
    best = min(singles, key=lambda t: judge.behind(t, base))
    odds = judge.odds(base, best, singles)
    total = sum(odds)
    rows = [
        Candidate(
            t.added, float((t.scores - base.scores).sum()), t.fit.rms, share / total,
            standard_error(t.scores - base.scores),
        )
        for t, share in zip(singles, odds, strict=False)
    ]  # fmt: skip
    rows += [
        Candidate(m.name, m.nats, float(np.sqrt(max(0.0, base.fit.rms**2 - m.rms**2))), math.nan)
        for m in seen
    ]
    return tuple(sorted(rows, key=lambda c: c.error))
