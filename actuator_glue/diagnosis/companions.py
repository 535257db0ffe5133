"""Effects that are there beyond chance but remove too little to matter.

They are not told as missing. But their size is free in the posterior of what is told: a gap that
leaves 2 um doubles the damping that is found beside it. What is not beyond chance, or not told
from others, stays what it is: one of many that may be there (discrepancy.py).
"""

from __future__ import annotations

import numpy as np

from actuator_glue.diagnosis.learned_forms import CAUSES
from actuator_glue.diagnosis.model_selection import ModelSelection
from actuator_glue.diagnosis.posterior import Draws
from actuator_glue.diagnosis.ranking import removed, weights
from actuator_glue.diagnosis.search import Search
from actuator_glue.diagnosis.trial import Trial

_MOST = 2
# Of what matters: less is made by the steps of simulations, too, beyond chance on long records.
_SEEN = 0.2
_ALONE = 0.9  # weight among what was tried that is told from the others


def with_companions(selection: ModelSelection, final: Trial) -> Trial:
    """Return a structure with what else is there beyond chance, at the user's level, and alone.

    Args:
        selection: what chose the structure.
        final: a structure that leaves nothing material.
    """
    search, settings = selection.search, selection.settings
    if final.own is not None:
        return final
    current, least = final, _SEEN * selection.material
    for _ in range(_MOST):
        others = [n for n in search.others(current) if not _of_one_kind(search, n, final)]
        ranked = search.screened(current, others)[: settings.tried]
        below = current.mean_square - least**2
        trials = search.additions(current, ranked, valves=False, below=below)
        if not trials or not selection.better(trials[0], current, least):
            break
        if weights(np.stack([t.scores for t in trials]))[0] < _ALONE:
            break
        current = trials[0]
    return current


def _of_one_kind(search: Search, name: str, final: Trial) -> bool:
    """Whether an effect shares the size of one that is told: two dry frictions are one."""
    causes = {CAUSES.get(told, told) for told in final.effects}
    holds = search.entries[name].holds
    return name in causes or (holds is not None and holds[0] in causes)


def reduced(draws: Draws, larger: Trial, final: Trial) -> Draws:
    """Return what draws of the larger structure say of the parameters of the other."""
    theirs = [p.name for p in larger.model.parameters]
    columns = [theirs.index(p.name) for p in final.model.parameters]
    unmet = tuple(draws.unmet[i] for i in columns) if draws.unmet else ()
    return draws._replace(points=draws.points[:, columns], unmet=unmet)


def sentences(final: Trial, larger: Trial) -> tuple[str, ...]:
    """Say which effects are held beside, and how little they remove."""
    names = [n for n in larger.effects if n not in final.effects]
    if not names:
        return ()
    return (
        f'{", ".join(names)} may be there, too: beyond chance, but it removes '
        f'{1e6 * removed(final, larger):.1f} um and does not matter; intervals allow for it',
    )
