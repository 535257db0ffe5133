"""The verdict of both parts of the records: one look at the held-out part checks the answer.

The fitting part chose the structure; the held-out part decided nothing, and confirms it or not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from actuator_glue.diagnosis.estimate import Estimate
from actuator_glue.diagnosis.finding import Finding
from actuator_glue.diagnosis.learned.term import any_learned
from actuator_glue.diagnosis.posterior import agreement
from actuator_glue.diagnosis.posterior.agreement import Homogeneity
from actuator_glue.diagnosis.posterior.answer_posterior import AnswerPosterior, estimates
from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.scopes.one_record import OneRecord
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.diagnosis.verdict import findings, held_out_reach, rules
from actuator_glue.diagnosis.verdict.held_out import HeldOutError
from actuator_glue.diagnosis.verdict.held_out_look import BandCurves, verify
from actuator_glue.diagnosis.verdicts import COMPLETE, Verdict
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import rms
from actuator_glue.records import Array


@dataclass(frozen=True)
class BothParts:
    """Verdict and evidence of both parts.

    Attributes:
        verdict: see DiagnosisData.
        final: the reported structure; one record's own setting acts in held-out records, too.
        effects: additions with sizes, rivals and probabilities.
        error: held-out error before and after.
        coverage: share of held-out samples in the 95 % band, before and after.
        curves: simulations and bands before and after, for pictures.
        stretches: sizes of each effect in halves of the records.
        estimates: of all parameters of the reported structure.
        estimates_before: of Eq. (2)'s without any addition.
        draws: posterior draws (m, p) that the estimates summarise.
        setup: another set-up that explains the records; None for the one given.
    """

    verdict: Verdict
    final: Trial
    effects: tuple[Finding, ...]
    error: HeldOutError
    coverage: tuple[float, float]
    curves: tuple[BandCurves, BandCurves]
    stretches: dict[str, Homogeneity]
    estimates: dict[str, Estimate]
    estimates_before: dict[str, Estimate]
    draws: Array
    setup: WrongSetup | None


def _where_it_acts(own: OneRecord, theta: Array, held: Data) -> OneRecord:
    """Return one record's own setting in those held-out records, too, that fit better with it.

    How a test was set of which nothing was fitted, only that test tells.
    """
    without = held.split(held.target - held.simulate(own, theta)[0])
    everywhere = own.acting_in(held.records)
    within = held.split(held.target - held.simulate(everywhere, theta)[0])
    rows = zip(held.records, within, without, strict=True)
    more = [record for record, a, b in rows if rms(a) < rms(b)]
    return own.acting_in((*own.records, *more))


def _acting(final: Trial, held: Data) -> bool:
    """Whether any addition acts in the held-out part; of one that does not, that says nothing."""
    own = final.own
    if not isinstance(own, OneRecord):
        return bool(final.effects)
    there = any(record is its for record in held.records for its in own.records)
    return there or any(name != own.own for name in final.effects)


def of(drawn: AnswerPosterior, other: WrongSetup | None, seed: int, each: Each) -> BothParts:
    """Look at the held-out part once, and return the verdict of both parts.

    Args:
        drawn: the answer of the fitting part and its posterior.
        other: another set-up under which Eq. (2) explains the records far better, if there is one.
        seed: seed of the intervals and of the sham effect.
        each: simulates records, several at a time if it can.
    """
    result, before, after = drawn.result, drawn.before, drawn.after
    decision, found = result.decision, result.found
    if isinstance(after.model, OneRecord):
        own = _where_it_acts(after.model, after.theta, result.prepared.held)
        after = replace(after, model=own)
        found = replace(found, final=replace(found.final, own=own))
    final, acting = found.final, _acting(found.final, result.prepared.held)
    held, fitted = (replace(d, each=each) for d in (result.prepared.held, result.data))
    error, coverage, curves = verify(
        fitted, held, before, after, found.noise, seed, result.line, len(found.singles)
    )
    error = held_out_reach.reached_by_both(
        error, found.material, result.scorer, held, before, after
    )
    judged = rules.of_both_parts(decision.verdict, acting, error, found.material)
    described = any_learned(final.structure)
    if other is not None and described and judged in COMPLETE:
        # A learned term that another set-up makes unnecessary describes the wrong set-up.
        judged = 'unexplained'
    draws, fixed = drawn.spread(judged in COMPLETE)
    sizes = estimates(drawn.space, after.model, draws, fixed)
    certain = rules.certainty(decision.certainty, acting, error, found.material)
    stretches = agreement.agreement(final, result.scorer)
    effects = findings.of(found, result.seen, certain, sizes, stretches)
    return BothParts(
        verdict=rules.named(judged, effects),
        final=final,
        effects=effects,
        error=error,
        coverage=coverage,
        curves=curves,
        stretches=stretches,
        estimates=sizes,
        estimates_before=drawn.estimates_before(),
        draws=draws,
        setup=result.prepared.setup or (None if judged in COMPLETE else other),
    )
