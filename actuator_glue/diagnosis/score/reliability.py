"""How often names with a given share of the weight are right: the reliability curve.

A share says what the records tell of the names in the catalogue: their weight relative to none of
them (weights.py), how much of the structure they explain in both parts of the records, and how
surely their sizes are not zero. It does not know how often the catalogue itself misleads, nor how
often a name without weight is right by luck: both were counted, on machines that decide nothing
else (`benchmarks/blind/reliability.py --fit`). By the law of total probability the curve is the
straight line between them.
"""

from __future__ import annotations

import math

from actuator_glue.diagnosis.estimate import Estimate

# How often names are right that have none of the weight, and that have all: 51 names of 60 blind
# machines of four generators, seeds 500 on and 70000 to 70014. The latter were diagnosed by commit
# be1a5e2, whose factors were divided out of its probabilities again. Asked again of 67 names of 80
# machines (seeds 96000 to 96019, commit 63dc55f): 0.54 and 0.97; but only three of these had less
# than 0.8 of the weight, which says nothing of names that have none.
CURVE = 0.2, 0.95


def calibrated(share: float, curve: tuple[float, float] = CURVE) -> float:
    """Return the probability that one of some names is right, in [0, 1].

    Args:
        share: their share of the weight, in [0, 1].
        curve: how often names are right that have none of the weight, and that have all.
    """
    luck, known = curve
    return luck + (known - luck) * min(max(share, 0.0), 1.0)


def share_of(probability: float, curve: tuple[float, float] = CURVE) -> float:
    """Return the share of the weight behind a probability, in [0, 1]: `calibrated` reversed."""
    luck, known = curve
    return min(max((probability - luck) / (known - luck), 0.0), 1.0)


def sureness(size: Estimate) -> float:
    """Return how surely a size lies on its side of the neutral value, in [0.5, 1].

    The probability of direction (Makowski et al. 2019), of a normal distribution; one where there
    is no neutral value.
    """
    if size.neutral is None:
        return 1.0
    if not size.stddev > 0.0:
        return 1.0 if size.mean != size.neutral else 0.5
    return 0.5 + 0.5 * math.erf(abs(size.mean - size.neutral) / size.stddev / math.sqrt(2.0))
