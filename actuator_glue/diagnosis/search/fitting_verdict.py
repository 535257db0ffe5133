"""The verdict on the fitting part of the records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.diagnosis.learned.term import any_learned, is_learned
from actuator_glue.diagnosis.measured.measurement import Measured
from actuator_glue.diagnosis.score.surrogate import Surrogate
from actuator_glue.diagnosis.selection import Selection
from actuator_glue.diagnosis.thresholds import (
    BEATEN_NOISE,
    BEATEN_SHARE,
    LEFT_NOISE,
    LEFT_SHARE,
    NATS,
)
from actuator_glue.diagnosis.verdicts import Verdict


@dataclass(frozen=True)
class Decision:
    """Verdict on the fitting part.

    Attributes:
        verdict: see `DiagnosisData`.
        left: rms structure that remains, without what measurement effects cause [m].
        certainty: where structure remains, the share of it that the names explain and a generic
            regression does not explain better; else 1.
        limit: rms structure above which a model counts as unexplained [m].
    """

    verdict: Verdict
    left: float
    certainty: float
    limit: float


def decide(
    found: Selection,
    seen: tuple[Measured, ...],
    surrogate: Surrogate,
) -> Decision:
    """Decide whether the effects found explain everything.

    Which additions are supported was decided one by one, each on its own evidence and size; they
    stay whatever remains beside them. Where a generic surrogate with as many parameters beats the
    names beyond chance, next to nothing may remain: they do not cause a structure that a
    regression on the motion explains better.
    """
    variance = sum(m.rms**2 for m in seen if m.name != 'hum')
    left = float(np.sqrt(max(0.0, found.left**2 - variance)))
    limit = max(LEFT_NOISE * found.noise, found.material, LEFT_SHARE * found.structure)
    if found.final.effects and surrogate.beats(found.material, NATS):
        floor = max(BEATEN_NOISE * found.noise, BEATEN_SHARE * found.structure)
        limit = min(limit, floor)
    verdict: Verdict = 'none'
    if left > limit:
        verdict = 'unexplained'
    elif found.final.effects or seen:
        verdict = 'missing-effect'
    doubted = verdict == 'unexplained' or (
        any_learned(found.final.structure) and left >= found.material
    )
    certainty = _certainty(found, left, surrogate) if doubted else 1.0
    return Decision(verdict, left, certainty, limit)


def _certainty(found: Selection, left: float, surrogate: Surrogate) -> float:
    """Return the share of the structure that the names are likely to cause, in [0, 1].

    The share that they explain, times what a regression with as many parameters leaves relative
    to what they leave: if a smooth function of the motion does much better, the names only stand
    for it. What a learned term explains does not count as theirs.
    """
    # Not relative to the structure found at first: under a stationary command most of it passes
    # for noise until something explains it.
    gained = max(0.0, found.base.mean_square - found.final.mean_square)
    terms = [e.name for e in found.final.structure.entries if is_learned(e)]
    named = max(0.0, gained - sum(found.removed[n] ** 2 for n in terms))
    explained = named / (gained + left**2) if gained > 0.0 else 0.0
    theirs = surrogate.structure_error**2 - found.noise**2
    generic = max(0.0, surrogate.error**2 - found.noise**2)
    return explained * (min(1.0, generic / theirs) if theirs > 0.0 else 1.0)
