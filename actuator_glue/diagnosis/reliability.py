"""How often names are right that a share of the weight stands behind: one curve.

A share says what the records tell of the names in the catalogue: their weight beside that of none
of them (weights.py), how much of the structure they explain in both parts of the records, and how
surely their sizes are not nothing. What it does not know is how often the catalogue itself
misleads; that was counted, on machines that decide nothing else
(`benchmarks/blind/reliability.py --fit`), as a straight line between the log odds of the share and
those of being right (Platt 1999).
"""

from __future__ import annotations

import math

from actuator_glue.diagnosis.estimate import Estimate

# Intercept and slope.
CURVE = 0.0, 1.0
_EDGE = 1e-3


def calibrated(share: float, curve: tuple[float, float] = CURVE) -> float:
    """Return the probability that one of some names is right, in [0, 1].

    Args:
        share: of the weight that stands behind them, in [0, 1].
        curve: intercept and slope.
    """
    return 1.0 / (1.0 + math.exp(-curve[0] - curve[1] * log_odds(share)))


def share_of(probability: float, curve: tuple[float, float] = CURVE) -> float:
    """Return the share of the weight behind a probability, in [0, 1]: `calibrated` reversed."""
    odds = (math.log(probability / (1.0 - probability)) - curve[0]) / curve[1]
    return 1.0 / (1.0 + math.exp(-odds))


def log_odds(share: float) -> float:
    """Return the log odds of a share; nearer to 0 or 1 than a thousandth it counts as that."""
    share = min(max(share, _EDGE), 1.0 - _EDGE)
    return math.log(share / (1.0 - share))


def sureness(size: Estimate) -> float:
    """Return how surely a size lies on the side of nothing on which it is told, in [0.5, 1].

    The probability of direction (Makowski et al. 2019), of a normal number; one where there is no
    size that leaves the model as it is.
    """
    if size.neutral is None:
        return 1.0
    if not size.stddev > 0.0:
        return 1.0 if size.mean != size.neutral else 0.5
    return 0.5 + 0.5 * math.erf(abs(size.mean - size.neutral) / size.stddev / math.sqrt(2.0))
