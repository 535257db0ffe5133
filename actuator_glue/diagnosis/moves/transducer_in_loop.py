"""Whether the controller closes its loop on the recorded transducer.

The piston follows the faults of such a transducer: its play, curve or lag leave another trace than
those of a transducer outside the loop. Without a fault of the transducer nothing tells the two
apart, so the loop is tried together with a fault.
"""

from __future__ import annotations

import math

from actuator_glue.diagnosis.refits.candidates import FAULTS, FEEDBACK
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import FAR
from actuator_glue.diagnosis.trial import Trial

_OWN = 2  # parameters: of the least fault and of the share that is fed back


def in_the_loop(beam: BeamSearch, found: Selection) -> Selection | None:
    """Put a fault of the transducer inside the controller's loop.

    Tried where structure remains, and where effects with more parameters may stand for it.

    Args:
        beam: the search that ended with `found`.
        found: what explains the records with a transducer beside the loop.

    Returns:
        The selection with the loop closed on the transducer, or None where that is not better.
    """
    refits, before = beam.refits, found.final
    stands = len(before.fit.theta) - len(found.base.fit.theta)
    if FEEDBACK in before.effects or (found.left < found.material and stands <= _OWN):
        return None
    tried: list[Trial] = []
    for name in FAULTS:
        starts = [refits.known((name,)), before if name in before.effects else None]
        tried += [refits.add(s, FEEDBACK) for s in starts if s]
    cost = math.log(max(1, len(tried)))

    def plainer(trial: Trial) -> bool:
        return len(trial.fit.theta) <= len(before.fit.theta)

    def may_be_better(trial: Trial) -> bool:
        far = FAR * before.mean_square
        return trial.mean_square < (far if plainer(trial) else beam.may_matter_below(before))

    def better(trial: Trial) -> bool:
        least = 0.0 if plainer(trial) else beam.material
        return beam.better(trial, before, least, cost)

    finished = [refits.polish(t, valves=False) for t in tried if may_be_better(t)]
    worth = [t for t in finished if better(t)]
    if not worth:
        return None
    best = max(worth, key=lambda t: float(t.scores.sum()) - len(t.fit.theta))
    return beam.grown_from(best, found)
