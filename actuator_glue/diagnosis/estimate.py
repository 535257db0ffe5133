"""Posterior of one parameter, and numbers that JSON can carry."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeAlias

Json: TypeAlias = dict[str, Any]


def number(value: float) -> float | None:
    """Return a number that JSON can carry: None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None


@dataclass(frozen=True, slots=True)
class Estimate:
    """Posterior of one parameter.

    Attributes:
        mean: posterior mean [unit].
        stddev: posterior standard deviation [unit].
        lower: 2.5 % quantile [unit].
        upper: 97.5 % quantile [unit].
        unit: SI unit.
        neutral: value that switches the effect off [unit]; None for parameters of Eq. (2).
        identified: the records fix it; else mean and interval are those of the bounds.
        bounds: prior bounds [unit].
    """

    mean: float
    stddev: float
    lower: float
    upper: float
    unit: str
    neutral: float | None = None
    identified: bool = True
    bounds: tuple[float, float] | None = None

    def to_json(self) -> Json:
        """Return the JSON object of one parameter."""
        values = {k: number(getattr(self, k)) for k in ('mean', 'stddev', 'lower', 'upper')}
        return {
            **values,
            'unit': self.unit,
            'neutral': self.neutral,
            'identified': self.identified,
            'bounds': list(self.bounds) if self.bounds else None,
        }
