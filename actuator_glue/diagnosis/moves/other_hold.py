"""How the command ran between its samples: held, as is assumed, or linearly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.conclusion import Conclusion
from actuator_glue.diagnosis.learned.term import any_learned
from actuator_glue.diagnosis.measured import hum
from actuator_glue.diagnosis.moves.learned_terms import LEARNED_TERMS
from actuator_glue.diagnosis.moves.move import Asking, after, beside, follow
from actuator_glue.diagnosis.preparation import Prepared
from actuator_glue.diagnosis.score import evidence
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.diagnosis.wrong_setup import WrongSetup
from actuator_glue.inference.least_squares.fit import Fit, fit

_SINGLES = 3  # best single effects that are refitted with the other hold


def with_the_right_hold(first: Conclusion, asking: Asking) -> Conclusion:
    """Decide whether the command was held or ran linearly; learn terms with that hold.

    The wrong hold is a lead of half a sample: no effect of the catalogue, but something will be
    found for it (a gain that drifts, say). The other hold is taken where Eq. (2) alone explains
    materially more with it, and the effects found with it explain more, beyond chance. Held
    commands taken for linear ones are a delay, which is in the catalogue. Where the catalogue
    explains the records with neither hold, terms are learned with both: an effect outside it may
    look like the other hold, which then must explain more beyond chance, or everything with fewer
    parameters.
    """
    other = _linearly(first, asking)
    if other is None:
        return follow(first, LEARNED_TERMS, asking)
    if not _explains_more(first, other, asking):
        return follow(beside(first, other), LEARNED_TERMS, asking)
    other = after(first, other, 'the command runs linearly between its samples')
    described = follow(other, LEARNED_TERMS, asking)
    if first.decision.verdict != 'unexplained':
        return described
    held = follow(first, LEARNED_TERMS, asking)
    return described if _explains_more(held, described, asking) else beside(held, described)


def _linearly(first: Conclusion, asking: Asking) -> Conclusion | None:
    """Return the conclusion with the other hold, where it may explain more.

    The search is made where Eq. (2) alone, or one of the best structures so far, explains more
    with it: while a large effect is missing, either hold may leave more. It is not made where a
    complete answer explains less with it.
    """
    prepared = first.prepared
    held_commands = any(r.hold == 'zoh' for r in prepared.fit.recorded)
    if first.decision.verdict == 'none' or not held_commands or first.effort.over:
        return None
    fitted, held = (data.with_setup(hold='linear') for data in (prepared.fit, prepared.held))
    other = replace(prepared, fit=fitted, held=held)
    base = Search(other.fit, ()).base()
    before = first.found.base.mean_square + (first.line.rms**2 if first.line else 0.0)
    found, singles = first.found.final, first.found.singles[:_SINGLES]
    gain = _gain(first, other, base, found)
    if max([gain, *(_gain(first, other, base, t) for t in singles)]) < asking.settings.nats:
        if before - base.rms**2 < first.found.material**2:
            return None
        named = first.decision.verdict == 'missing-effect' and not any_learned(found.structure)
        if named and gain < 0.0:
            return None
    asking.tell('other hold', 0.0)
    second = asking.conclude(other)
    errors, enough = (before**0.5, base.rms), second.decision.verdict == 'none'
    setup = WrongSetup.between(prepared.fit, other.fit, errors, enough, taken=True)
    second = replace(second, prepared=replace(second.prepared, setup=setup))
    return replace(second, others=second.in_scope(second.others))


def _explains_more(first: Conclusion, second: Conclusion, asking: Asking) -> bool:
    """Whether the second, with the other hold, explains more beyond chance.

    Or everything, with fewer parameters: a hold is a plainer answer than a term that imitates its
    lead of half a sample.
    """
    fewer = len(second.found.final.fit.theta) < len(first.found.final.fit.theta)
    whole = second.decision.verdict != 'unexplained'
    return _gained(first, second) >= (0.0 if whole and fewer else asking.settings.nats)


def _gained(first: Conclusion, second: Conclusion) -> float:
    """Nats that the second explains more, under its noise, less its further parameters."""
    a, b, scorer = first.found.final.fit, second.found.final.fit, second.scorer
    gained = evidence(scorer.block_scores(b), scorer.block_scores(a))
    return gained - len(b.theta) + len(a.theta)


def _gain(first: Conclusion, other: Prepared, base: Fit, trial: Trial) -> float:
    """Return the nats that a structure with the other hold gains over the answer found.

    Less its further parameters. With misfit nats say little: then a structure that does not leave
    materially less explains no more.
    """
    found, scorer = first.found.final, first.scorer
    data = other.fit if first.line is None else hum.without(other.fit, first.line)
    starts = np.stack([trial.fit.theta, trial.fit.theta])
    starts[1, : len(base.theta)] = base.theta
    again = first.effort.spent_on(fit(data, trial.model, starts))
    nats = evidence(scorer.block_scores(again), scorer.block_scores(found.fit))
    gain = nats - len(again.theta) + len(found.fit.theta)
    complete = first.decision.verdict == 'missing-effect'
    matters = found.mean_square - again.rms**2 >= first.found.material**2
    return gain if complete or matters else min(gain, 0.0)
