"""Effects that are tried only on what all others leave."""

from __future__ import annotations

import math

from actuator_glue.diagnosis.moves.move import Asking
from actuator_glue.diagnosis.refits.candidates import mean_effects
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.search.conclusion import Conclusion, searched


def with_reserved(first: Conclusion, asking: Asking) -> Conclusion | None:
    """Search again with the effects that are reserved for what all others leave.

    Begun where one of them, alone or beside the effects found, is better beyond chance and by a
    material error; they may lead to effects that the first search did not reach. A mode that rings
    on passes for hum: so the search is tried first on data from which hum was not removed.
    """
    reserved, before, prepared = mean_effects(reserved=True), first.found.final, first.prepared
    if not reserved:
        return None
    usual, cost = first.beam.refits, math.log(len(reserved))
    ways = [(usual.wider(reserved), first.line)]
    if first.line is not None:
        names = *usual.names, *reserved
        ways.insert(0, (Refits(prepared.fit, names, usual.each, effort=usual.effort), None))

    # Even where it is added to Eq. (2) alone, it must be better than the answer found.
    below = first.beam.may_matter_below(before)
    for refits, line in ways:
        refits.scorer = first.scorer
        refits.base()
        starts = [
            refits.trial(t.effects) for t in (first.found.base, before) if refits.known(t.effects)
        ]
        tried = [t for s in starts for t in refits.additions(s, reserved, below=below)]
        if any(first.beam.better(t, before, first.found.material, cost) for t in tried):
            second = searched(prepared, refits, line, asking.settings, asking.tell)
            if second.outweighs(first):
                return second
    return None
