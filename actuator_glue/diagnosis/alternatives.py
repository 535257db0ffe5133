"""Intervals of parameters where effects cannot be told apart.

A lag of the transducer and one of the valve fit the same motion beside other values of beta_1.
Where a name has alternatives, an interval under that name alone says too much: those of Eq. (2)'s
parameters, and of the sizes of other effects, are those of the mixture of all structures, each
with the weight of its name.
"""

from __future__ import annotations

from actuator_glue.diagnosis.conclusion import Conclusion
from actuator_glue.diagnosis.trial import Trial

_LEAST = 1e-3  # probability that odds are taken against


def alternatives(result: Conclusion) -> list[tuple[Trial, float]]:
    """Return structures with a tied effect in place of the told one, and their odds."""
    final, search = result.decision.final, result.selection.search
    out: list[tuple[Trial, float]] = []
    for name in result.decision.names if final.own is None else ():
        row = {rival.name: rival for rival in result.found.rivals[name]}
        rest = [n for n in final.effects if n != name]
        for rival in row.values():
            trial = search.known((*rest, *rival.effects)) if rival.tied else None
            if trial is not None and rival.name != name:
                out.append((trial, rival.probability / max(row[name].probability, _LEAST)))
    return out
