"""Posterior of one parameter."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_glue.json_value import Json, JsonObject

__all__ = ['Estimate', 'Json']


@dataclass(frozen=True, slots=True)
class Estimate(JsonObject):
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
