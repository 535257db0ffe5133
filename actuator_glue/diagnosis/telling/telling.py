"""The reported diagnosis: one object from which report, JSON, figures and exit code are made."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from actuator_glue.diagnosis.learned import term as learned_term
from actuator_glue.diagnosis.posterior.answer_posterior import AnswerPosterior
from actuator_glue.diagnosis.samples.preparation import Prepared
from actuator_glue.diagnosis.search import table
from actuator_glue.diagnosis.telling import advice, companion_notes, response
from actuator_glue.diagnosis.telling.headline import record_names
from actuator_glue.diagnosis.telling.next_experiment import Experiment, ranked
from actuator_glue.diagnosis.telling.remaining import remaining
from actuator_glue.diagnosis.telling.response import Response
from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.diagnosis.verdict import findings
from actuator_glue.diagnosis.verdict.alarm import alarm_of
from actuator_glue.diagnosis.verdict.both_parts import BothParts
from actuator_glue.diagnosis.verdict.traces import traces
from actuator_glue.diagnosis.verdicts import COMPLETE
from actuator_glue.hygiene import rest
from actuator_glue.hygiene.clean import rest_samples
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.prior_use import PriorUse
from actuator_glue.json_value import Json
from actuator_glue.model.parameters import BASE

# Draws that are run with sines: the ends of an interval over 32 of them leave out 11 %, not 5 %.
_RESPONSES = 400


def told(
    drawn: AnswerPosterior,
    both: BothParts,
    false_alarms: float,
    prior: PriorUse | None,
    seed: int,
    each: Each,
) -> DiagnosisData:
    """Return the reported diagnosis.

    Args:
        drawn: the answer of the fitting part and its posterior.
        both: its verdict and evidence in both parts.
        false_alarms: probability of an addition on a healthy machine, as asked for.
        prior: what was known before; None for nothing.
        seed: seed of what the alarm simulates.
        each: simulates several records at a time if it can.
    """
    result, after, sizes = drawn.result, drawn.after, both.estimates
    found, data, prepared = result.found, result.data, result.prepared
    decision, final = result.decision, both.final
    pressed = drawn.pressed()
    experiments = _experiments(drawn)
    learned = learned_term.described(final, data, sizes)
    contradicted = advice.contradicted(both.error, found.material)
    still, left = _at_rest(drawn), remaining(data, final.fit.error, decision)
    shown = (
        *traces(prepared.fit, False, both.curves),
        *traces(prepared.held, True, both.curves),
    )
    held_out = [source for source, _, _ in both.error.records]
    return DiagnosisData(
        verdict=both.verdict,
        effects=both.effects,
        error=both.error,
        candidates=findings.candidates(result.beam, found, result.seen),
        coverage=both.coverage,
        alarm=alarm_of(result, false_alarms, seed, each),
        advice=(
            *([prior.contradiction()] if prior and prior.contradicted else []),
            *advice.at_bound(pressed, sizes),
            *([result.onset.sentence()] if result.onset else []),
            *advice.ended(result.effort),
            *(term.sentence() for term in learned),
            *advice.of(decision, left, found, result.generic, both.stretches, experiments),
            *contradicted,
            *advice.zeros(both.error, found.material, record_names(shown, held_out)),
            *_beside(drawn, final, bool(contradicted)),
            *advice.unidentified(data, sizes),
            *advice.unconverged(float(np.fmax(drawn.alone.rhat, drawn.with_companions.rhat))),
            *rest.compared(data.records, still, found.noise),
            *([prior.remark()] if prior else []),
            *prepared.remarks,
        ),
        base={p.name: sizes[p.name] for p in BASE},
        structure=final.effects,
        learned=learned,
        base_before={n: e for n, e in both.estimates_before.items() if n in sizes},
        responses=_responses(drawn),
        experiments=experiments,
        onset=result.onset,
        prior=prior,
        setup=both.setup,
        structures=table.weighed(
            result.rows(), found.material, final.effects, result.scope, result.leaves_nothing
        ),
        names=tuple(p.name for p in after.model.parameters),
        posterior=both.draws,
        which=drawn.mixture.which,
        mixture=drawn.mixture.structures,
        joint=after.draws,
        rhat=drawn.alone.rhat,
        sampler=drawn.alone.to_json(),
        best=after.theta,
        traces=shown,
        history=result.history,
        surrogate=result.generic.to_json(),
        remaining=left,
        at_bound=pressed,
        effort=result.effort.share,
        preparation=tuple(prepared.remarks),
        sampling=tuple(_sampling(prepared, still)),
    )


def _beside(drawn: AnswerPosterior, final: Trial, missed: bool) -> tuple[str, ...]:
    """Name further effects that may be there: too small to matter, or in held-out records only.

    Args:
        drawn: the answer of the fitting part and its posterior.
        final: the reported structure.
        missed: whether the held-out part shows more than noise.
    """
    result, held = drawn.result, drawn.result.prepared.held
    said = companion_notes.sentences(final, drawn.larger, held, missed)
    if said or not missed or result.decision.verdict not in COMPLETE or result.effort.over:
        return said
    return companion_notes.hint(result.beam, final, held)


def _experiments(drawn: AnswerPosterior) -> tuple[Experiment, ...]:
    """Rank tests by what they would tell about names that these records leave tied."""
    result = drawn.result
    if not drawn.rivals:
        return ()
    final, scale = result.found.final, result.beam.refits.scale()
    rivals = [trial for trial, _ in drawn.rivals]
    return ranked(final, rivals, result.scorer, scale, result.found.noise)


def _responses(drawn: AnswerPosterior) -> tuple[Response, ...]:
    """Return the frequency response at each stiffness."""
    after, scale = drawn.after, drawn.result.beam.refits.scale()
    some = after.draws[:: max(len(after.draws) // _RESPONSES, 1)]
    stiffness = sorted({r.known_stiffness() for r in drawn.result.data.records})
    return tuple(response.of(after.model, after.theta, some, scale, k) for k in stiffness)


def _at_rest(drawn: AnswerPosterior) -> list[float | None]:
    """Return the noise of each record where it rests [m]; None where it does not."""
    data = drawn.result.data
    return [
        rest.noise_at_rest(r, rest_samples(r), initial)
        for r, initial in zip(data.records, data.initials, strict=True)
    ]


def _sampling(prepared: Prepared, still: Sequence[float | None]) -> Iterator[Json]:
    """Yield each record's rates as recorded and as fitted; `still` is its noise at rest [m]."""
    rows = (prepared.fit.records, prepared.fit.recorded, prepared.impulses, still)
    for record, whole, impulses, noise in zip(*rows, strict=True):
        yield {
            'source': record.source,
            'rate_hz': whole.rate,
            'fitted_rate_hz': record.rate,
            'impulse_samples': len(impulses.samples),
            'noise_at_rest_m': noise,
        }
