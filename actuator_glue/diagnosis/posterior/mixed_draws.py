"""Draws over all plausible structures; each draw knows its structure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.diagnosis.trial import Trial
from actuator_glue.records import Array

_ROUND = 1e-3  # odds below it move no interval


@dataclass(frozen=True)
class MixedDraws:
    """Draws over structures; each draw knows its structure.

    Attributes:
        points: parameters of the reported structure (m, p).
        which: index of its structure in `structures`, for every draw (m,).
        structures: effects of each.
    """

    points: Array
    which: NDArray[np.intp]
    structures: tuple[tuple[str, ...], ...]

    @classmethod
    def of(cls, points: Array, effects: tuple[str, ...]) -> MixedDraws:
        """Return draws (m, p) of one structure."""
        return cls(points, np.zeros(len(points), dtype=np.intp), (effects,))


def shares(
    which: NDArray[np.intp], structures: Sequence[tuple[str, ...]]
) -> list[tuple[tuple[str, ...], float]]:
    """Return the share of draws that each structure has, the largest first.

    Args:
        which: index of the structure of every draw (m,).
        structures: effects of each.
    """
    count = np.bincount(which, minlength=len(structures))
    order = np.argsort(-count, kind='stable')
    return [(structures[i], float(count[i] / len(which))) for i in order if count[i]]


def mixed(
    draws: MixedDraws,
    told: Trial,
    others: Sequence[tuple[Trial, float]],
    sample: Callable[[Trial], Array],
    rng: np.random.Generator,
) -> MixedDraws:
    """Return draws of the shared parameters over all plausible structures.

    Where an alternative lacks an effect, its draws keep the size under the reported structure.

    Args:
        draws: those of the reported structure.
        told: that structure.
        others: alternatives with their odds against it.
        sample: returns posterior draws (k, q) of a structure with q parameters.
        rng: random numbers.
    """
    known = [(trial, odds) for trial, odds in others if odds > _ROUND]
    odds = np.array([1.0, *(o for _, o in known)])
    took = rng.choice(len(odds), len(draws.points), p=odds / odds.sum())
    names, points = [p.name for p in told.model.parameters], draws.points.copy()
    which, structures = draws.which.copy(), list(draws.structures)
    for i, (trial, _) in enumerate(known, 1):
        mine, theirs = np.flatnonzero(took == i), [p.name for p in trial.model.parameters]
        drawn = sample(trial)
        rows = drawn[rng.integers(0, len(drawn), len(mine))]
        for j, name in enumerate(names):
            if name in theirs:
                points[mine, j] = rows[:, theirs.index(name)]
        if trial.effects not in structures:
            structures.append(trial.effects)
        which[mine] = structures.index(trial.effects)
    return MixedDraws(points, which, tuple(structures))
