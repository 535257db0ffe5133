"""How the command ran between its samples: held, as is assumed, or linearly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from actuator_glue.diagnosis.conclusion import Conclusion
from actuator_glue.diagnosis.learned.term import any_learned
from actuator_glue.diagnosis.measured import hum
from actuator_glue.diagnosis.moves.learned_terms import LEARNED_TERMS
from actuator_glue.diagnosis.moves.move import Asking, after, follow
from actuator_glue.diagnosis.preparation import Prepared
from actuator_glue.diagnosis.score import evidence
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.wrong_setup import WrongSetup
from actuator_glue.inference.least_squares.fit import Fit, fit


def with_the_right_hold(first: Conclusion, asking: Asking) -> Conclusion:
    """Decide whether the command was held or ran linearly; learn terms with that hold.

    The wrong hold is a lead of half a sample: no effect of the catalogue, but something will be
    found for it (a gain that drifts, say). The other hold is taken where Eq. (2) alone explains
    materially more with it, and what is found with it explains more, beyond chance. Held
    commands taken for linear ones are a delay, which is in the catalogue. Where the catalogue
    explains neither, terms are learned with both: what it lacks may look like the other hold,
    which must explain more beyond chance then, or all that remains with fewer parameters.
    """
    other = _linearly(first, asking)
    if other is None:
        return follow(first, LEARNED_TERMS, asking)
    described = follow(other, LEARNED_TERMS, asking)
    if first.decision.verdict != 'unexplained':
        return described
    held = follow(first, LEARNED_TERMS, asking)
    return described if _explains_more(held, described, asking) else held


def _linearly(first: Conclusion, asking: Asking) -> Conclusion | None:
    """Return what is found with the other hold, where that explains more.

    An answer that leaves nothing and explains less with the other hold is not searched for again:
    of a large effect that Eq. (2) leaves, either hold may leave more.
    """
    prepared = first.prepared
    held_commands = any(r.hold == 'zoh' for r in prepared.fit.recorded)
    if first.decision.verdict == 'none' or not held_commands or first.effort.over:
        return None
    fitted, held = (data.with_setup(hold='linear') for data in (prepared.fit, prepared.held))
    other = replace(prepared, fit=fitted, held=held)
    base = Search(other.fit, ()).base()
    before = first.found.base.mean_square + (first.line.rms**2 if first.line else 0.0)
    if before - base.rms**2 < first.found.material**2:
        return None
    asking.tell('other hold', 0.0)
    described = any_learned(first.found.final.structure)
    named = first.decision.verdict == 'missing-effect' and not described
    if named and _explains_less(first, other, base):
        return None
    second = asking.conclude(other)
    if not _explains_more(first, second, asking):
        return None
    errors, enough = (before**0.5, base.rms), second.decision.verdict == 'none'
    setup = WrongSetup.between(prepared.fit, other.fit, errors, enough, taken=True)
    second = replace(second, prepared=replace(second.prepared, setup=setup))
    return after(first, second, 'the command runs linearly between its samples')


def _explains_more(first: Conclusion, second: Conclusion, asking: Asking) -> bool:
    """Whether the second, with the other hold, explains more beyond chance.

    Or all that remains with fewer parameters: a hold is a plainer answer than a term that leads by
    half a sample as well.
    """
    fewer = len(second.found.final.fit.theta) < len(first.found.final.fit.theta)
    whole = second.decision.verdict != 'unexplained'
    return _gained(first, second) >= (0.0 if whole and fewer else asking.settings.nats)


def _gained(first: Conclusion, second: Conclusion) -> float:
    """Nats that the second explains more, under its noise, less its further parameters."""
    a, b, scorer = first.found.final.fit, second.found.final.fit, second.scorer
    gained = evidence(scorer.block_scores(b), scorer.block_scores(a))
    return gained - len(b.theta) + len(a.theta)


def _explains_less(first: Conclusion, other: Prepared, base: Fit) -> bool:
    """Whether what was found explains less with the other hold, whose Eq. (2) is fitted."""
    found = first.found.final
    data = other.fit if first.line is None else hum.without(other.fit, first.line)
    starts = np.stack([found.fit.theta, found.fit.theta])
    starts[1, : len(base.theta)] = base.theta
    again, scorer = fit(data, found.model, starts), first.scorer
    return evidence(scorer.block_scores(again), scorer.block_scores(found.fit)) < 0.0
