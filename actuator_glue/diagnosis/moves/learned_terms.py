"""Learn terms that the catalogue has no name for, where it leaves material structure.

Sparse regression inside of the loop: forms at every place are screened by their signatures, the
most promising are refitted together with Eq. (2) and the effects found, in the free-run
simulation, and one is kept if it gains out of sample what any addition must, plus the price of
having been chosen among many. Names come before descriptions: a term is added to named effects,
and replaces them only where it explains the rest, or much that they do not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from actuator_glue.diagnosis.learned.forms import CAUSES
from actuator_glue.diagnosis.learned.friction import DRY, FALLING, SHAPES
from actuator_glue.diagnosis.learned.term import is_learned
from actuator_glue.diagnosis.moves.move import AnswerMove, Asking, Groups, left
from actuator_glue.diagnosis.refits.structures import Search
from actuator_glue.diagnosis.search.beam_search import BeamSearch
from actuator_glue.diagnosis.search.conclusion import Conclusion
from actuator_glue.diagnosis.search.gains import removed
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import (
    FAR,
    MOST_TERMS,
    REPLACING,
    RESHAPING,
    RESHAPING_STROKE,
    TERM_TIED,
    Thresholds,
)
from actuator_glue.diagnosis.trial import Trial

Way = Callable[[BeamSearch, Selection], Selection | None]
_LONG = 100_000  # samples


def plainer(result: Conclusion, asking: Asking) -> Conclusion | None:
    """Return a description in place of names that leave nothing material, where it is better."""
    selection = result.selection.apart()  # all ways share its forms and their signatures
    for way in ways(result.found):
        if result.effort.over:
            break
        if other := result.complete(selection, way(selection, result.found)):
            return other
    return None


def with_terms(result: Conclusion, asking: Asking) -> Conclusion | None:
    """Add learned terms for material structure that the catalogue leaves, or names badly.

    Another shape of a named cause is tried before further terms.
    """
    selection, found = result.selection, result.found
    described = reshaped(selection, found)
    if described is None or described.left >= described.material:
        described = learned(selection, described or found) or described
    return None if described is None else result.of(selection, described)


def ways(found: Selection) -> list[Way]:
    """Return the searches to make where effects leave nothing material, in order.

    They may leave much structure that passes for noise until a form explains it; for long records
    that is not searched, as it would take half as long as all the rest.
    """
    if not found.final.effects:
        return []
    if found.final.fit.error.size > _LONG:
        return [*([instead] if len(found.final.effects) > 1 else []), reshaped]
    return [instead, reshaped, partial(learned, complete=True)]


def learned(selection: BeamSearch, found: Selection, complete: bool = False) -> Selection | None:
    """Add learned terms to a selection.

    Args:
        selection: the model selection that ended with `found`.
        found: what the catalogue explains.
        complete: whether the names leave nothing material: structure may still pass for noise
            until a form explains it. A form replaces such names only where it removes materially
            more.

    Returns:
        The selection with learned terms, or None where none is worth it.
    """
    search, best = selection.search, found.final
    for turn in range(MOST_TERMS):
        if search.effort.over:
            break
        selection.progress('learned term', turn / MOST_TERMS)
        # A wrong name may stand where the term belongs: start from Eq. (2) alone, too.
        starts = [best] if turn or not best.effects else [best, search.trial(())]
        better = _additions(selection, starts, best, complete)
        if better is None:
            break
        best = _plainer(selection, better)
        selection.renoise(best)
        best = search.trial(best.effects, best.added)
        if selection.left(best) < selection.material:
            break
    if best is found.final:
        return None
    singles = selection.rescored(found.singles)
    return selection.checked(best, search.trial(()), singles, exchanged=not search.effort.over)


def instead(selection: BeamSearch, found: Selection) -> Selection | None:
    """Return one term in place of all effects, where it is better for its parameters.

    Lost motion of the command moves the piston nearly as play and a lag of the transducer do, two
    names for one cause, or as a dead band of the valve, a wrong name. The term pays in nats for
    its parameters and for having been chosen among many; in place of a single name it must also
    gain what any addition must, and remove half of what matters, since a name is worth more.

    Args:
        selection: the model selection that ended with `found`; its noise stays.
        found: names that leave nothing material.
    """
    search, base = selection.search, selection.search.trial(())
    selection.progress('learned term', 0.0)
    (tried,) = selection.with_terms([base], FAR * found.final.mean_square)
    whole = [t for t in tried if selection.left(t) < selection.material]
    if not whole:
        return None
    best = max(whole, key=lambda trial: _merit(search, trial))
    least = math.log(len(search.terms()))
    if len(found.final.effects) == 1:
        least = _decisive(search, selection.settings)
        much = _least_removed(best.added, found.final.effects, selection.material)
        if removed(found.final, best) < much:
            return None
    if _gain(search, best, found.final) <= least:
        return None
    return selection.checked(_plainer(selection, best), base, found.singles)


def reshaped(selection: BeamSearch, found: Selection) -> Selection | None:
    """Return an answer with another shape of its dry friction, if the records show that.

    Friction that builds up over 1 mm/s leaves less than what matters if it is fitted as friction
    that is there at once; but damping and valve speed, which that shifts, are far off on records
    of another kind.

    Args:
        selection: the model selection that ended with `found`; its noise stays.
        found: names.
    """
    search, named = selection.search, found.final
    # Names that are dry friction, or tied with it.
    dry = {DRY, FALLING}
    told = [n for n, row in found.rivals.items() if any(r.tied and r.name in dry for r in row)]
    if not told:
        return None
    search.terms()  # the shapes are among them
    least = _decisive(search, selection.settings)
    selection.progress('learned term', 0.0)
    # In place of the name, or beside it, as friction may also fall with velocity.
    best = named
    in_place = [search.without(named, name) for name in told]
    for starts, share in ((in_place, RESHAPING), ([named], REPLACING)):
        seen = max(share * selection.material, RESHAPING_STROKE * search.scale().stroke)
        below = best.mean_square - 0.5 * seen**2  # or nearly
        if found.left >= selection.material:
            below = math.inf  # where names fit badly, so do rough refits of shapes
        trials = [t for s in starts for t in search.additions(s, SHAPES, below=below)]
        worth = [t for t in trials if removed(best, t) > seen]
        better = max(worth, key=lambda t: _gain(search, t, best), default=best)
        if better is not best and _gain(search, better, best) > least:
            best = better
    if best is named:
        return None
    return selection.checked(best, search.trial(()), found.singles)


def as_good_and_plainer(selection: BeamSearch, found: Selection, named: Selection) -> bool:
    """Whether a description explains everything, better than names and with no more parameters.

    Names that include an effect which no record shows by itself, such as a fault that the
    controller reads, may stand for something outside the catalogue: they are kept only where they
    explain more than a description, out of sample and less a nat per parameter.

    Args:
        selection: the model selection that ended with both.
        found: the description.
        named: the names.
    """
    best, names = found.final, named.final
    if found.left >= selection.material or len(best.fit.theta) > len(names.fit.theta):
        return False
    return _gain(selection.search, best, names) > 0.0


def _gain(search: Search, best: Trial, other: Trial) -> float:
    """Nats out of sample by which a structure is better, less one for each further parameter."""
    assert search.scorer is not None
    gain = search.scorer.block_scores(best.fit) - search.scorer.block_scores(other.fit)
    return float(gain.sum()) + len(other.fit.theta) - len(best.fit.theta)


def _additions(
    selection: BeamSearch,
    starts: Sequence[Trial],
    best: Trial,
    complete: bool,
) -> Trial | None:
    """Return the best structure with one more term, where it is worth more than the present."""
    search, worth = selection.search, list[Trial]()
    cost = math.log(len(search.terms()))
    # While something remains, a term in place of names may remove little more than these.
    rows = selection.with_terms(starts, selection.may_matter_below(best) if complete else math.inf)
    for start, row in zip(starts, rows, strict=True):
        for trial in row:
            least = selection.material
            if start is not best:
                # In place of names a term must explain the rest, and be more than tied with them:
                # while something remains, a name is worth more than a description.
                whole = selection.left(trial) < selection.material
                if not whole or not selection.better(trial, start, least, cost):
                    continue
                tied = TERM_TIED * removed(start, trial)
                least = max(tied, selection.material) if complete else tied
            if selection.better(trial, best, least, cost):
                worth.append(trial)
    worth.sort(key=lambda trial: _merit(search, trial), reverse=True)
    return next((t for t in worth if not _displaces(selection, t, best)), None)


def _plainer(selection: BeamSearch, trial: Trial) -> Trial:
    """Replace a term by the simpler form it contains, unless it is worth more than that."""
    search, holds = selection.search, selection.search.entries[trial.added].holds
    if holds is None or holds[0] in trial.effects:
        return trial
    plain = search.additions(search.without(trial, trial.added), [holds[0]])[0]
    return trial if selection.better(trial, plain, selection.material) else plain


def _displaces(selection: BeamSearch, trial: Trial, best: Trial) -> bool:
    """Whether a term would only replace names that explain nearly the same.

    With the term they are not worth their parameters, though something remains: a smooth form may
    be closer to the machine than the catalogue's equation for the same cause. Names that leave
    materially more than the term do not explain nearly the same.
    """
    search = selection.search
    after = selection.pruned(trial)
    if selection.left(after) < selection.material:
        return False
    rest = best
    for name in best.effects:
        if name not in after.effects and not is_learned(search.entries[name]):
            rest = search.without(rest, name)
    nearly = 1.0 - TERM_TIED
    alike = removed(best, after) < selection.material
    return alike and removed(rest, best) ** 2 > nearly * removed(rest, after) ** 2


def _merit(search: Search, trial: Trial) -> float:
    """Out-of-sample score less a nat per parameter; with misfit, minus the left-out error [m].

    Nats weigh the frequencies with the least noise: where structure remains they prefer a model
    that leaves more of it elsewhere.
    """
    assert search.scorer is not None
    if not search.scorer.likely:
        return -search.scorer.left_out_error(trial.fit)
    return float(trial.scores.sum()) - len(trial.fit.theta)


def _decisive(search: Search, settings: Thresholds) -> float:
    """Return by how many nats a description, one of many, must be better than a name."""
    forms = sum(map(is_learned, search.entries.values()))
    return settings.nats + math.log(max(forms, 1))


def _least_removed(form: str, names: Sequence[str], material: float) -> float:
    """Return the error that a description must remove to replace names, which count more [m].

    Half of what matters, or all of that where it is another shape of one of them.
    """
    return material if CAUSES.get(form) in names else REPLACING * material


# The move for material structure.
LEARNED_TERMS: Final[Groups] = ((AnswerMove('learned terms', left, with_terms),),)
