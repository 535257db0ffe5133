"""The error that effects remove, and how far a difference of block scores is chance.

Nats of block scores answer one question alone: is an effect there beyond chance (weights.py
decides all others). They come block by block, so their spread says how far they are chance.
"""

from __future__ import annotations

import numpy as np

from actuator_glue.diagnosis.refits.refits import Refits
from actuator_glue.diagnosis.score.scorer import evidence
from actuator_glue.diagnosis.thresholds import WORTH_FINISHING
from actuator_glue.diagnosis.trial import Trial
from actuator_glue.records import Array


def removed(before: Trial, after: Trial) -> float:
    """Rms error that a larger structure removes [m]."""
    return float(np.sqrt(max(0.0, before.mean_square - after.mean_square)))


def left_by_rivals(rest: Trial, best: Trial) -> float:
    """Mean squared error below which a rough refit of a rival is worth finishing [m^2]."""
    return rest.mean_square - WORTH_FINISHING**2 * (rest.mean_square - best.mean_square)


def worth(refits: Refits, final: Trial) -> tuple[dict[str, float], dict[str, float]]:
    """Return, by effect, rms error [m] removed and nats gained beside the other effects."""
    gains, nats = {}, {}
    for name in final.effects:
        rest = refits.without(final, name)
        gains[name], nats[name] = removed(rest, final), evidence(final.scores, rest.scores)
    return gains, nats


def standard_error(difference: Array) -> float:
    """Return the standard error of the sum of block differences (B,) [nats]."""
    # Squares may overflow for a structure that diverges without a block.
    size = float(np.abs(difference).max()) or 1.0
    return float(np.sqrt(len(difference)) * (difference / size).std(ddof=1)) * size
