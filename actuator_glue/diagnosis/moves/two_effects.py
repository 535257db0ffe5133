"""Two effects that matter only together: each hides the other.

A droop of the supply and a delay may each remove 3 um beside 10 um of noise, less than what
matters, but together the 8 um that are missing. Pairs are tried last, where neither names nor
descriptions are worth adding.
"""

from __future__ import annotations

from actuator_glue.diagnosis.score.weights import choices
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.trial import Trial


def explained(beam: BeamSearch, found: Selection) -> Selection | None:
    """Add two effects at once to a selection.

    Args:
        beam: the search that ended with `found`.
        found: what single additions explain.

    Returns:
        The selection with both, or None where no two have more weight.
    """
    refits, current = beam.refits, found.final
    beam.progress('two effects', 0.0)
    count = len(refits.names)
    cost = choices(count, 2) - choices(count, 1)  # the level covers the choice of a single one
    there = [t for t in _both(beam, current) if beam.better(t, current, 0.0, cost)]
    best = beam.heaviest([current, *there])
    if best is current:
        return None
    beam.renoise(best)
    return beam.checked(refits.trial(best.effects, best.added), found.singles)


def _both(beam: BeamSearch, current: Trial) -> list[Trial]:
    """Refit with two more effects: each promising one, with the most promising given that."""
    refits = beam.refits

    def other(start: Trial) -> list[str]:
        return beam.promising(start, refits.others(start))

    firsts = refits.additions(current, other(current), valves=False)
    return [pair for first in firsts for pair in refits.additions(first, other(first))]
