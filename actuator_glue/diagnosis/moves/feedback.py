"""Whether the controller closes its loop on the recorded transducer.

The piston follows the faults of such a transducer: its play, curve or lag leave another trace than
those of a transducer outside the loop. Without a fault of the transducer nothing tells the two
apart, so the loop is tried together with a fault.
"""

from __future__ import annotations

import math

from actuator_glue.diagnosis.moves import learned_terms
from actuator_glue.diagnosis.moves.move import Asking, after
from actuator_glue.diagnosis.refits.candidates import FAULTS, FEEDBACK
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import FAR
from actuator_glue.diagnosis.trial import Trial

_OWN = 2  # parameters: of the least fault and of the share that is fed back


def fed_back(result: Conclusion, asking: Asking) -> Conclusion | None:
    """Return the answer with a fault of the transducer inside the controller's loop.

    Or the answer with learned terms in place of that fault, where these are better.
    """
    found = in_the_loop(result.selection, result.found)
    if found is None:
        return None
    if described := _described(result, found):
        return after(result, described, 'a description in place of a fault inside the loop')
    closed = result.of(result.selection, found)
    return after(result, closed, "the transducer's fault inside the loop")


def _described(result: Conclusion, inside: Selection) -> Conclusion | None:
    if inside.left >= result.selection.material:
        return None
    selection = result.selection.apart()
    found = learned_terms.learned(selection, result.found)
    if found is None or not learned_terms.as_good_and_plainer(selection, found, inside):
        return None
    return result.complete(selection, found)


def in_the_loop(selection: BeamSearch, found: Selection) -> Selection | None:
    """Put a fault of the transducer inside the controller's loop.

    Tried where structure remains, and where effects with more parameters may stand for it.

    Args:
        selection: the model selection that ended with `found`.
        found: what explains the records with a transducer beside the loop.

    Returns:
        The selection with the loop closed on the transducer, or None where that is not better.
    """
    search, before = selection.search, found.final
    stands = len(before.fit.theta) - len(found.base.fit.theta)
    if FEEDBACK in before.effects or (found.left < found.material and stands <= _OWN):
        return None
    tried: list[Trial] = []
    for name in FAULTS:
        starts = [search.known((name,)), before if name in before.effects else None]
        tried += [search.add(s, FEEDBACK) for s in starts if s]
    cost = math.log(max(1, len(tried)))

    def plainer(trial: Trial) -> bool:
        return len(trial.fit.theta) <= len(before.fit.theta)

    def may_be_better(trial: Trial) -> bool:
        far = FAR * before.mean_square
        return trial.mean_square < (far if plainer(trial) else selection.may_matter_below(before))

    def better(trial: Trial) -> bool:
        least = 0.0 if plainer(trial) else selection.material
        return selection.better(trial, before, least, cost)

    finished = [search.polish(t, valves=False) for t in tried if may_be_better(t)]
    worth = [t for t in finished if better(t)]
    if not worth:
        return None
    best = max(worth, key=lambda t: float(t.scores.sum()) - len(t.fit.theta))
    while len(best.effects) < selection.settings.most:
        selection.renoise(best)
        best = search.trial(best.effects, best.added)
        if selection.left(best) < selection.material:
            break
        further = selection.extend([best], len(best.effects))
        worth = [t for t in further if selection.better(t, best, selection.material)]
        if not worth:
            break
        best = worth[0]
    singles = selection.rescored(found.singles)
    return selection.checked(best, search.trial(()), singles)
