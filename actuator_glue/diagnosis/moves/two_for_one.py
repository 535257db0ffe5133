"""Two effects in place of one that seems enough.

A gain that drifts may leave what passes for noise where a slow valve and a clock that runs fast
are the machine's: each of them alone is worse than the wrong name. What is there beside that name
beyond chance, though too little to matter, tells: with it another name may stand for the rest, as
many parameters and more evidence. Names of more than one parameter have pairs as rivals
(diagnosis/pairs.py).
"""

from __future__ import annotations

from actuator_glue.diagnosis.beam_search import BeamSearch
from actuator_glue.diagnosis.companions import SEEN, beside
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.trial import Trial


def exchanged(selection: BeamSearch, found: Selection) -> Selection | None:
    """Return a selection with two effects in place of one, or None.

    Args:
        selection: the model selection that ended with `found`; its noise stays.
        found: what leaves nothing material.
    """
    with_more = _with_more(selection, found.final)
    if with_more is None:
        return None
    best = with_more
    for name in found.final.effects:
        if len(selection.search.entries[name].parameters) == 1:
            best = _better(selection, with_more, name, best)
    if best is with_more:
        return None
    return selection.checked(best, selection.search.trial(()), found.singles)


def _with_more(selection: BeamSearch, final: Trial) -> Trial | None:
    """Return the structure with its best significant but immaterial effect added, if any."""
    if final.own is not None or not final.effects:
        return None
    seen = SEEN * selection.material
    trials = beside(selection, final, selection.search.others(final), seen)
    return next((t for t in trials if selection.better(t, final, seen)), None)


def _better(selection: BeamSearch, with_more: Trial, name: str, best: Trial) -> Trial:
    """Return a structure with another name in the place of one, where that has more weight.

    Args:
        selection: what judges.
        with_more: the structure with the name and what is there beside it.
        name: of which another may take the place.
        best: of those found so far.
    """
    search = selection.search
    rest = search.without(with_more, name)
    names = search.screened(rest, search.others(with_more))[: selection.settings.tried]
    for trial in search.additions(rest, names, below=with_more.mean_square):
        enough = selection.left(trial) < selection.material
        # Each of the two must matter beside the other.
        if enough and selection.behind(trial, best) < 0.0 and selection.pruned(trial) is trial:
            best = trial
    return best
