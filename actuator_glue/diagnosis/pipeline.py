"""From prepared records to a conclusion: search, then moves; impulses and hum judged again."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from actuator_glue.diagnosis.effort import Effort
from actuator_glue.diagnosis.measured import hum
from actuator_glue.diagnosis.measured.hum import Line
from actuator_glue.diagnosis.moves.learned_terms import LEARNED_TERMS
from actuator_glue.diagnosis.moves.move import Asking, follow
from actuator_glue.diagnosis.moves.registry import ACROSS, WITHIN
from actuator_glue.diagnosis.refits.candidates import mean_effects
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.samples import final_impulses
from actuator_glue.diagnosis.samples.preparation import Prepared
from actuator_glue.diagnosis.search import undetermined_motion
from actuator_glue.diagnosis.search.conclusion import Conclusion, searched
from actuator_glue.diagnosis.stages import Progress
from actuator_glue.diagnosis.thresholds import Thresholds
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import fit


class _Begun(NamedTuple):
    """Records, the search of their samples that count, and hum that was removed from them."""

    prepared: Prepared
    refits: Refits
    line: Line | None


def conclude(
    prepared: Prepared, settings: Thresholds, each: Each, tell: Progress, effort: Effort
) -> Conclusion:
    """Search for what the model lacks and decide; nothing looks at the held-out part.

    Args:
        prepared: the records.
        settings: what a caller may set.
        each: refits candidates, several at a time if it can.
        tell: takes progress.
        effort: cost of the search so far, and its limit.
    """

    def again(other: Prepared) -> Conclusion:
        return _within(other, asking, each, effort.extended(), fixed=True)

    asking = Asking(settings, tell, again)
    named = _within(prepared, asking, each, effort)
    return follow(named, (*LEARNED_TERMS, *ACROSS), asking)


def as_given(
    prepared: Prepared, settings: Thresholds, each: Each, tell: Progress, effort: Effort
) -> Conclusion:
    """Conclude from Eq. (2), alone and with each single effect, without any further search."""
    tell('base fit', 0.0)
    prepared, refits, line = _begun(prepared, each, effort, fixed=True)
    return searched(prepared, refits, line, replace(settings, most=0), tell)


def _within(
    prepared: Prepared, asking: Asking, each: Each, effort: Effort, fixed: bool = False
) -> Conclusion:
    """Search records with their hold, for names first.

    Samples that friction leaves to chance do not count, unless the counted samples are fixed. If
    the final model shows impulses that could have swayed the search, or that suspected ones are
    none, these are removed, or restored, and the search goes on from there.
    """
    asking.tell('base fit', 0.0)
    begun = _begun(prepared, each, effort, fixed)
    begun, named = _judged_again(begun, _named(begun, asking), asking)
    moved = follow(named, WITHIN, asking)
    if moved.found is named.found:
        return moved
    _, again = _judged_again(begun, moved, asking)
    return again if again is moved else follow(again, WITHIN, asking)


def _judged_again(begun: _Begun, result: Conclusion, asking: Asking) -> tuple[_Begun, Conclusion]:
    """Judge impulses against the final model; search on from its answer where they swayed it."""
    prepared, final = begun.prepared, result.found.final
    clean = final_impulses.without_impulses(prepared, final)
    taken = prepared.fit.target - clean.fit.target
    if clean is prepared or not final_impulses.swayed(final.fit, result.scorer, taken):
        return begun, result
    refits = begun.refits
    begun = _begun(clean, refits.each, refits.effort, fixed=True)
    return begun, _named(begun, asking, result)


def _begun(prepared: Prepared, each: Each, effort: Effort, fixed: bool) -> _Begun:
    names = *mean_effects(), *prepared.also
    refits = Refits(prepared.fit, names, each, effort=effort)
    line = hum.find(prepared.fit, refits.base().error)
    if line is not None:
        data = hum.without(prepared.fit, line)
        refits = Refits(data, names, each, effort=effort)
    return _Begun(*undetermined_motion.without(prepared, refits, fixed), line)


def _named(begun: _Begun, asking: Asking, before: Conclusion | None = None) -> Conclusion:
    """Search for names, from those found `before` if given; hum is judged again in the end."""
    (prepared, refits, line), settings, tell = begun, asking.settings, asking.tell
    result = searched(prepared, refits, line, settings, tell, before)
    if line is None or not result.found.final.effects:
        return result
    left = _line_left(prepared.fit, result.found.final)
    if left is not None and left.same_as(line):
        return result
    data = prepared.fit if left is None else hum.without(prepared.fit, left)
    refits = Refits(data, refits.names, refits.each, effort=refits.effort)
    return searched(prepared, refits, left, settings, tell, result)


def _line_left(data: Data, final: Trial) -> Line | None:
    """Return the hum in the final residual: in Eq. (2)'s it may be an effect's response."""
    return hum.find(data, fit(data, final.model, final.fit.theta).error)
