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
_EDGE = 1e-3  # shares nearer to 0 or 1 count as this


def calibrated(share: float, curve: tuple[float, float] = CURVE) -> float:
    """Return the probability that one of some names is right, in [0, 1].

    Args:
        share: of the weight that stands behind them, in [0, 1].
        curve: intercept and slope.
    """
    share = min(max(share, _EDGE), 1.0 - _EDGE)
    odds = curve[0] + curve[1] * math.log(share / (1.0 - share))
    return 1.0 / (1.0 + math.exp(-odds))


def sureness(size: Estimate) -> float:
    """Return how surely a size is not the one that leaves the model as it is, in [0, 1].

    The probability that a normal number as far from that size is not chance; one where there is
    no such size.
    """
    if size.neutral is None:
        return 1.0
    if not size.stddev > 0.0:
        return float(size.mean != size.neutral)
    return math.erf(abs(size.mean - size.neutral) / size.stddev / math.sqrt(2.0))
