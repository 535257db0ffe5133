"""Two effects in place of one that seems enough.

For a machine with a slow valve and a clock that runs fast, a drifting gain may leave only what
passes for noise: each of the true names alone is worse than the wrong one. A significant but
immaterial effect beside the wrong name is the clue: with it another name may explain the rest,
with as many parameters and more evidence. Names of more than one parameter have pairs as rivals
(diagnosis/search/pairs.py).
"""

from __future__ import annotations

from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.search.companions import beside
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import SEEN, TRIED
from actuator_glue.diagnosis.trial import Trial


def exchanged(beam: BeamSearch, found: Selection) -> Selection | None:
    """Return a selection with two effects in place of one, or None.

    Args:
        beam: the search that ended with `found`; its noise stays.
        found: its result, which leaves nothing material.
    """
    with_more = _with_more(beam, found.final)
    if with_more is None:
        return None
    best = with_more
    for name in found.final.effects:
        if len(beam.refits.entries[name].parameters) == 1:
            best = _better(beam, with_more, name, best)
    if best is with_more:
        return None
    return beam.checked(best, found.singles)


def _with_more(beam: BeamSearch, final: Trial) -> Trial | None:
    """Return the structure with its best significant but immaterial effect added, if any."""
    if final.own is not None or not final.effects:
        return None
    seen = SEEN * beam.material
    trials = beside(beam, final, beam.refits.others(final), seen)
    return next((t for t in trials if beam.better(t, final, seen)), None)


def _better(beam: BeamSearch, with_more: Trial, name: str, best: Trial) -> Trial:
    """Return a structure with another name in the place of one, where that has more weight.

    Args:
        beam: the judge.
        with_more: the structure with the name and the immaterial effect.
        name: the one that another may replace.
        best: the best structure so far.
    """
    refits = beam.refits
    rest = refits.without(with_more, name)
    names = refits.promises.best(rest, refits.others(with_more))[:TRIED]
    for trial in refits.additions(rest, names, below=with_more.mean_square):
        enough = beam.left(trial) < beam.material
        # Each of the two must matter beside the other.
        if enough and beam.behind(trial, best) < 0.0 and beam.pruned(trial) is trial:
            best = trial
    return best
