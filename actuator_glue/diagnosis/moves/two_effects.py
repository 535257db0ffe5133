"""Two effects that matter only together: each hides the other.

A droop of the supply and a delay may each remove 3 um beside 10 um of noise, less than what
matters, but together the 8 um that are missing. Pairs are tried last, where neither names nor
descriptions are worth adding, and reported only where they explain all that is left.
"""

from __future__ import annotations

from actuator_glue.diagnosis.refits.structures import by_score
from actuator_glue.diagnosis.score.weights import choices
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.trial import Trial


def explained(selection: BeamSearch, found: Selection) -> Selection | None:
    """Add two effects at once to a selection.

    Args:
        selection: the model selection that ended with `found`.
        found: what single additions explain.

    Returns:
        The selection with both, or None where no two explain the rest.
    """
    search, current = selection.search, found.final
    selection.progress('two effects', 0.0)
    worth = [t for t in _both(selection, current) if _is_worth(selection, t, current)]
    if not worth:
        return None
    best = min(worth, key=by_score)
    selection.renoise(best)
    singles = selection.rescored(found.singles)
    chosen = selection.checked(search.trial(best.effects, best.added), search.trial(()), singles)
    return chosen if chosen.left < chosen.material else None


def _both(selection: BeamSearch, current: Trial) -> list[Trial]:
    """Refit with two more effects: each promising one, with the most promising given that."""
    search = selection.search

    def other(start: Trial) -> list[str]:
        return selection.promising(start, search.others(start))

    firsts = search.additions(current, other(current), valves=False)
    return [pair for first in firsts for pair in search.additions(first, other(first))]


def _is_worth(selection: BeamSearch, trial: Trial, current: Trial) -> bool:
    """Whether two effects explain the rest, and neither is idle beside the other."""
    count = len(selection.search.names)
    cost = choices(count, 2) - choices(count, 1)  # the level covers the choice of a single one
    if selection.left(trial) >= selection.material:
        return False
    if not selection.better(trial, current, selection.material, cost):
        return False
    added = [n for n in trial.effects if n not in current.effects]
    without = [selection.search.without(trial, n) for n in added]
    return all(selection.better(trial, rest, selection.least(trial, rest)) for rest in without)
