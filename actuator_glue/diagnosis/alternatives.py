"""Intervals of parameters where effects cannot be told apart.

A lag of the transducer and one of the valve fit the same motion beside other values of beta_1.
Where a name has alternatives, an interval under that name alone says too much: those of Eq. (2)'s
parameters, and of the sizes of other effects, are those of the mixture of all structures, each
with the weight of its name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from actuator_glue.diagnosis.pipeline import Conclusion
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.records import Array

_ROUND = 1e-3  # odds below it move no interval


def alternatives(result: Conclusion) -> list[tuple[Trial, float]]:
    """Return structures with a tied effect in place of the told one, and their odds."""
    final, search = result.decision.final, result.selection.search
    out: list[tuple[Trial, float]] = []
    for name in result.decision.names if final.own is None else ():
        row = {rival.name: rival for rival in result.found.rivals[name]}
        rest = [n for n in final.effects if n != name]
        for rival in row.values():
            trial = search.known((*rest, *rival.effects)) if rival.tied else None
            if trial is not None and rival.name != name:
                out.append((trial, rival.probability / max(row[name].probability, _ROUND)))
    return out


def mixed(
    draws: Array,
    told: Trial,
    others: Sequence[tuple[Trial, float]],
    sample: Callable[[Trial], Array],
    rng: np.random.Generator,
) -> Array:
    """Return draws (m, p) of the shared parameters over all plausible structures.

    The size of an effect that an alternative lacks is that which it has where its name is right.

    Args:
        draws: those of the structure that is told (m, p).
        told: that structure.
        others: alternatives with their odds against it.
        sample: draws from the posterior of a structure.
        rng: random numbers.
    """
    known = [(trial, odds) for trial, odds in others if odds > _ROUND]
    odds = np.array([1.0, *(o for _, o in known)])
    which = rng.choice(len(odds), len(draws), p=odds / odds.sum())
    names, out = [p.name for p in told.model.parameters], draws.copy()
    for i, (trial, _) in enumerate(known, 1):
        mine, theirs = np.flatnonzero(which == i), [p.name for p in trial.model.parameters]
        drawn = sample(trial)
        rows = drawn[rng.integers(0, len(drawn), len(mine))]
        for j, name in enumerate(names):
            if name in theirs:
                out[mine, j] = rows[:, theirs.index(name)]
    return out
