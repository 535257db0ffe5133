"""Distribution of a number over draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.records import Array


@dataclass(frozen=True, slots=True)
class Spread:
    """Distribution of a number over the draws: mean, standard deviation, 95 % limits."""

    mean: float
    stddev: float
    lower: float
    median: float
    upper: float


def spread(values: Array) -> Spread:
    """Return mean, standard deviation and 95 % limits of values (m,)."""
    lower, median, upper = np.quantile(values, (0.025, 0.5, 0.975))
    return Spread(
        float(values.mean()), float(values.std()), float(lower), float(median), float(upper)
    )
