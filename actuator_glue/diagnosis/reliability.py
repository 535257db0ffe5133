"""How often names are right that a share of the weight stands behind: one curve.

A share says what the records tell of the names in the catalogue: their weight beside that of none
of them (weights.py), how much of the structure they explain in both parts of the records, and how
surely their sizes are not nothing. What it does not know is how often the catalogue itself
misleads, and how often a name is right all the same: both were counted, on machines that decide
nothing else (`benchmarks/blind/reliability.py --fit`). By the law of total probability the curve
is the straight line between them.
"""

from __future__ import annotations

import math

from actuator_glue.diagnosis.estimate import Estimate

# How often names are right where nothing of the weight is theirs, and where all is: 51 names of 60
# blind machines of four generators, seeds 500 on and 70000 to 70014. The latter were diagnosed by
# commit be1a5e2, whose factors were taken out of its probabilities again.
CURVE = 0.2, 0.95


def calibrated(share: float, curve: tuple[float, float] = CURVE) -> float:
    """Return the probability that one of some names is right, in [0, 1].

    Args:
        share: of the weight that stands behind them, in [0, 1].
        curve: how often names are right where no weight is theirs, and where all is.
    """
    luck, known = curve
    return luck + (known - luck) * min(max(share, 0.0), 1.0)


def share_of(probability: float, curve: tuple[float, float] = CURVE) -> float:
    """Return the share of the weight behind a probability, in [0, 1]: `calibrated` reversed."""
    luck, known = curve
    return min(max((probability - luck) / (known - luck), 0.0), 1.0)


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
