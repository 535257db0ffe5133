"""How far a parameter depends on the other effects, where no structure is the machine.

A posterior says what is known under one structure. If that leaves something material it is wrong,
and other structures that leave little more give the same parameter other values: their spread is
what the choice of the equations leaves open (Draper 1995, Assessment and propagation of model
uncertainty). So is the spread between stretches of the records, of other frequencies and
amplitudes.
"""

from __future__ import annotations

import numpy as np

from actuator_glue.diagnosis.posterior import agreement
from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import Scorer
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.inference.least_squares.space import Space
from actuator_glue.records import Array
from actuator_glue.robust import NORMAL


def open_form(refits: Refits, final: Trial, left: float, space: Space, scorer: Scorer) -> Array:
    """Return the standard deviation of parameters due to wrong equations (p,).

    Standard deviations in working coordinates: that over structures (see `spread`) and that
    between stretches, together. Structures are not compared with one that has an effect in one
    record only.
    """
    stretches = agreement.between(final, scorer)
    return stretches if final.own else np.hypot(stretches, spread(refits, final, left, space))


def spread(refits: Refits, final: Trial, left: float, space: Space) -> Array:
    """Return the spread of each parameter over equally good structures (p,).

    In working coordinates, by the median: an effect that makes the same motion may take a
    parameter anywhere, but is one of many.

    Args:
        refits: all structures that were tried.
        final: the reported one.
        left: rms structure that it leaves [m]; the others leave twice its square at most.
        space: working coordinates of `final`.
    """
    names = [p.name for p in final.structure.parameters]
    told = space.z(final.fit.theta)
    off: list[list[float]] = [[] for _ in names]
    for structure, fit in refits.left_at_most(final.mean_square + left**2):
        theirs = {p.name: i for i, p in enumerate(structure.parameters)}
        shared = [i for i, name in enumerate(names) if name in theirs]
        theta = np.array(final.fit.theta)
        theta[shared] = fit.theta[[theirs[names[i]] for i in shared]]
        moved = np.abs(space.z(theta) - told)
        if structure.effects != final.effects:
            for i in shared:
                off[i].append(float(moved[i]))
    return np.array([NORMAL * float(np.median(rows)) if rows else 0.0 for rows in off])


def widened(draws: Array, size: Array, space: Space, rng: np.random.Generator) -> Array:
    """Return draws (m, p) moved at random by standard deviations (p,), working coordinates.

    For intervals of one parameter at a time: jointly, moved draws leave the posterior's ridges.
    """
    moved = space.z(draws) + size * rng.standard_normal(draws.shape)
    return space.theta(np.clip(moved, space.lower, space.upper))
