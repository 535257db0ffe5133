"""Effects that are there beyond chance but remove too little to matter.

They are not reported as missing. But their size is free in the posterior of the reported effects:
a gap that leaves 2 um doubles the damping found beside it. An effect that is not beyond chance, or
cannot be told from other groups, is left to the random discrepancy (discrepancy.py).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from actuator_glue.diagnosis.beam_search import BeamSearch
from actuator_glue.diagnosis.gains import removed
from actuator_glue.diagnosis.learned.forms import CAUSES
from actuator_glue.diagnosis.posterior import Draws
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.fit import rms
from actuator_glue.model.effects import CATALOGUE

_MOST = 2
# Of what matters: on long records, simulation steps cause smaller errors beyond chance, too.
SEEN = 0.2
_ALONE = 0.9  # weight among all tried that tells an effect's group from the others


def with_companions(
    selection: BeamSearch, final: Trial, least: float | None = None, *, alone: bool = True
) -> Trial:
    """Add effects that are significant at the user's level but too small to be told.

    Args:
        selection: what chose the structure.
        final: a structure that leaves nothing material.
        least: error that each must remove [m]; a fifth of what matters if not given.
        alone: whether each must be distinguishable from effects of other groups.
    """
    search = selection.search
    if final.own is not None:
        return final
    current = final
    least = SEEN * selection.material if least is None else least
    for _ in range(_MOST):
        others = [n for n in search.others(current) if not _of_one_kind(search, n, final)]
        trials = beside(selection, current, others, least)
        if not trials or not selection.better(trials[0], current, least):
            break
        if alone and _weight_of_its_group(selection, trials) < _ALONE:
            break
        current = trials[0]
    return current


def _weight_of_its_group(selection: BeamSearch, trials: Sequence[Trial]) -> float:
    """Return the weight of the best effect's group among trials.

    Which of two lags it is may stay open; without either, beta_1 would be wrong.
    """
    groups = [selection.search.entries[t.added].group for t in trials]
    shares = zip(selection.shares(trials), groups, strict=True)
    return float(sum(share for share, group in shares if group == groups[0]))


def alike(selection: BeamSearch, final: Trial, larger: Trial) -> list[tuple[Trial, float]]:
    """Return structures with an indistinguishable effect in place of a companion, with odds.

    Intervals average over indistinguishable effects (mixed_draws.mixed): beta_1 differs between
    the lag of a valve and one of the transducer.

    Args:
        selection: what chose the structure.
        final: the reported structure.
        larger: the same with its companions.
    """
    search, out = selection.search, list[tuple[Trial, float]]()
    for name in _beside(final, larger):
        rest, kind = [n for n in larger.effects if n != name], search.entries[name].group
        like = [n for n in search.others(larger) if search.entries[n].group == kind]
        tried = [t for n in like if (t := search.known((*rest, n))) is not None]
        shares = selection.shares([larger, *tried])
        out += [(t, float(w / shares[0])) for t, w in zip(tried, shares[1:], strict=True)]
    return out


def beside(
    selection: BeamSearch, current: Trial, names: Sequence[str], least: float
) -> list[Trial]:
    """Refit a structure with the effects that promise most; best out-of-sample score first.

    Args:
        selection: what chose the structure.
        current: the structure.
        names: the effects.
        least: error that an effect must remove [m]; those that remove less are refitted roughly.
    """
    search = selection.search
    ranked = search.screened(current, names)[: selection.settings.tried]
    below = current.mean_square - least**2
    return search.additions(current, ranked, valves=False, below=below)


def _of_one_kind(search: Search, name: str, final: Trial) -> bool:
    """Whether an effect is another form of a reported one: two dry frictions are one."""
    causes = {CAUSES.get(told, told) for told in final.effects}
    holds = search.entries[name].holds
    return name in causes or (holds is not None and holds[0] in causes)


def reduced(draws: Draws, larger: Trial, final: Trial, known: Sequence[bool]) -> Draws:
    """Return the final structure's parameters in draws of the larger one.

    Args:
        draws: of the larger structure.
        larger: that structure.
        final: the reported structure.
        known: which of its parameters (p,) the records fix without the companions, which are too
            small to fix any.
    """
    theirs = [p.name for p in larger.model.parameters]
    columns = [theirs.index(p.name) for p in final.model.parameters]
    met = [not draws.unmet[i] for i in columns] if draws.unmet else known
    unmet = tuple(not (a and b) for a, b in zip(met, known, strict=True))
    return draws._replace(points=draws.points[:, columns], unmet=unmet)


def sentences(final: Trial, larger: Trial, held: Data, missed: bool) -> tuple[str, ...]:
    """Name the companions, and how little error they remove.

    Args:
        final: the reported structure.
        larger: the same with its companions.
        held: the held-out part.
        missed: whether the held-out part shows more than noise. Then its error with and without
            them is told, too: that they do not matter holds for the fitting records only.
    """
    names = _beside(final, larger)
    if not names:
        return ()
    kinds = Counter(e.group for e in CATALOGUE.values())
    like = any(kinds[e.group] > 1 for e in larger.structure.entries if e.name in names)
    said = (
        f'{", ".join(names)}{" (or what is like it)" if like else ""} may be there, too: '
        'beyond chance, but it removes '
        f"{1e6 * removed(final, larger):.1f} um of the fitting records' error, less than what "
        'matters; intervals allow for it'
    )
    if missed:
        left = (1e6 * _left(held, t) for t in (larger, final))
        said += '; the held-out part leaves {:.1f} um with it, {:.1f} um without'.format(*left)
    return (said,)


def hint(selection: BeamSearch, final: Trial, held: Data) -> tuple[str, ...]:
    """Name effects that may explain the held-out part where the answer does not.

    Args:
        selection: what chose the structure.
        final: a structure that leaves nothing material of the fitting records.
        held: the held-out part, which shows more than noise.

    Returns:
        Nothing where no effect beyond chance in the fitting records explains the held-out part.
    """
    larger = with_companions(selection, final, alone=False)
    names = _beside(final, larger)
    with_it, without = _left(held, larger), _left(held, final)
    if not names or without - with_it < SEEN * selection.material:
        return ()
    return (
        f'{", ".join(names)} (or what is like it) is not added: beyond chance, but it removes '
        f"{1e6 * removed(final, larger):.2g} um of the fitting records' error, less than what "
        f'matters; the held-out part leaves {1e6 * with_it:.2g} um with it, {1e6 * without:.2g} '
        'um without: fit a record like it',
    )


def _beside(final: Trial, larger: Trial) -> list[str]:
    return [n for n in larger.effects if n not in final.effects]


def _left(held: Data, trial: Trial) -> float:
    return rms(held.target - held.simulate(trial.model, trial.fit.theta)[0])
