"""Learn terms that the catalogue has no name for, where they have more weight than names alone.

Sparse regression inside of the loop: forms at every place are screened by their signatures, the
most promising are refitted together with Eq. (2) and the effects found, in the free-run
simulation. A term may be added to names, replace them all, or give a named cause another shape;
which of these structures is told, the weight decides (score/weights.py).
"""

from __future__ import annotations

import math
from typing import Final

from actuator_glue.diagnosis.learned.forms import shape_of
from actuator_glue.diagnosis.moves.move import AnswerMove, Groups, left, to
from actuator_glue.diagnosis.refits.refits import Asked
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import FAR, MOST_TERMS
from actuator_glue.diagnosis.trial import Trial

_LONG = 100_000  # samples


def with_terms(beam: BeamSearch, found: Selection) -> Selection | None:
    """Add learned terms while they have more weight.

    Args:
        beam: the search that ended with `found`.
        found: what the catalogue explains.

    Returns:
        The selection with learned terms, or None where no structure has more weight with one.
    """
    refits, best = beam.refits, found.final
    for turn in range(MOST_TERMS):
        if refits.effort.over:
            break
        beam.progress('learned term', turn / MOST_TERMS)
        heavier = _heavier(beam, found, best)
        if heavier is best:
            break
        beam.renoise(heavier)
        best = refits.trial(heavier.effects, heavier.added)
        if beam.left(best) < beam.material:
            break
    if best is found.final:
        return None
    return beam.checked(best, found.singles, exchanged=not refits.effort.over)


def _heavier(beam: BeamSearch, found: Selection, best: Trial) -> Trial:
    """Return the heaviest structure with one more learned term, or the best so far.

    A term must be there beyond chance, as any addition.

    Args:
        beam: refits and weighs.
        found: names, with their rivals.
        best: the best structure so far.
    """
    refits, asked = beam.refits, _asked(beam, found, best)
    cost = math.log(len(refits.terms()))
    rows = zip(asked, refits.additions_to(asked), strict=True)
    tried = [t for a, row in rows for t in row if beam.better(t, a.current, 0.0, cost)]
    return beam.heaviest([best, *tried])


def _asked(beam: BeamSearch, found: Selection, best: Trial) -> list[Asked]:
    """Return the refits that promise most: a term beside all, alone, or in place of its cause.

    Where names leave nothing material, structure may still pass for noise until a form explains
    it. On long records that would take half as long as all the rest: there a complete answer is
    held against one term alone, if it has several names, and against other shapes of its causes.
    """
    refits, complete = beam.refits, beam.left(best) < beam.material
    asked, brief = [], complete and best.fit.error.size > _LONG
    if not brief:
        below = beam.may_matter_below(best) if complete else math.inf
        asked.append(Asked(best, beam.promising_terms(best, below), below))
    if best is not found.final:
        return asked
    if len(best.effects) > (1 if brief else 0):
        base, below = refits.trial(()), FAR * best.mean_square if complete else math.inf
        asked.append(Asked(base, beam.promising_terms(base, below), below))
    for name in best.effects:
        causes = {r.name for r in found.rivals.get(name, ()) if r.tied} | {name}
        shapes = [n for n in refits.terms() if shape_of(n, causes) and n not in best.effects]
        if shapes:
            rest = refits.without(best, name)
            asked.append(Asked(rest, tuple(shapes), best.mean_square if complete else math.inf))
    return asked


# The move for material structure.
LEARNED_TERMS: Final[Groups] = ((AnswerMove('learned terms', left, to(with_terms)),),)
