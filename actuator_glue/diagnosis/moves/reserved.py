"""Effects that are tried only on what all others leave."""

from __future__ import annotations

import math
from dataclasses import replace

from actuator_glue.diagnosis.moves.move import Asking
from actuator_glue.diagnosis.refits.candidates import mean_effects
from actuator_glue.diagnosis.refits.structures import Search
from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.diagnosis.search.conclusion import Conclusion, searched
from actuator_glue.diagnosis.trial import Trial


def with_reserved(first: Conclusion, asking: Asking) -> Conclusion | None:
    """Search again with the effects that are reserved for what all others leave.

    Begun where one of them, alone or beside the effects found, is better beyond chance and by a
    material error. The new answer must be better likewise, and contain one of them or be complete
    without: they may lead to effects that the first search did not reach. A mode that rings on
    passes for hum: so the search is tried first on data from which hum was not removed.
    """
    reserved, before, prepared = mean_effects(reserved=True), first.found.final, first.prepared
    if not reserved:
        return None
    usual, cost = first.selection.search, math.log(len(reserved))
    ways = [(usual.wider(reserved), first.line)]
    if first.line is not None:
        names = *usual.names, *reserved
        ways.insert(0, (Search(prepared.fit, names, usual.each, effort=usual.effort), None))

    # Even where it is added to Eq. (2) alone, it must be better than the answer found.
    below = first.selection.may_matter_below(before)

    def better(after: Trial, scorer: Scorer) -> bool:
        known = replace(before, scores=scorer.block_scores(before.fit))
        return first.selection.better(after, known, first.found.material, cost)

    for search, line in ways:
        search.scorer = first.scorer
        search.base()
        starts = [
            search.trial(t.effects) for t in (first.found.base, before) if search.known(t.effects)
        ]
        tried = [t for s in starts for t in search.additions(s, reserved, below=below)]
        if not any(better(t, first.scorer) for t in tried):
            continue
        second = searched(prepared, search, line, asking.settings, asking.tell)
        found = second.found.final
        told = set(found.effects) & set(reserved) or second.decision.verdict != 'unexplained'
        if told and better(found, second.scorer):
            return second
    return None
