"""The calibrated parameters of Eq. (2): one table of symbols, units and Table 3 bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from actuator_glue.records import Array

# Sampling coordinates of an effect's parameters (`ridge_effects`), in the order they are undone.
Coordinate: TypeAlias = Literal[
    'gain',
    'damping',
    'share',
    'sliding-force',
    'mass-damping',
    'lost-share',
    'flow',
    'per-flow',
    'log',
    'line',
]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter that can be estimated.

    Attributes:
        name: identifier used in JSON, messages and on the command line.
        unit: SI unit, '1' where there is none.
        lower: lower prior bound [unit].
        upper: upper prior bound [unit].
        meaning: one line for people.
        neutral: value that switches an effect off; None for the base model.
        coordinate: what it is sampled as under one stiffness; None for itself.
    """

    name: str
    unit: str
    lower: float
    upper: float
    meaning: str
    neutral: float | None = None
    coordinate: Coordinate | None = None


# Table 3 of the paper; the unit of beta_1 is 1/s there by dimension (printed N/s^2).
BASE: tuple[Parameter, ...] = (
    Parameter('beta_1', '1/s', 0.0, 4e2, 'inverse servo-valve time constant'),
    Parameter('alpha_1_beta_0', 'N/(m s^2)', 0.0, 2e10, 'flow gain times valve and P gain'),
    Parameter('alpha_2', 'N/m', 0.0, 1e7, 'oil stiffness 2 beta A^2/V'),
    Parameter('alpha_3', '1/s', 0.0, 1e2, 'leakage 2 beta K_c/V'),
)
NAMES: tuple[str, ...] = tuple(p.name for p in BASE)

# Table 2 of the paper (deterministic identification), in the order of BASE.
TABLE_2: Array = np.array([128.0, 1.01e9, 2.42e5, 0.06])


def bounds(parameters: tuple[Parameter, ...] = BASE) -> tuple[Array, Array]:
    """Return lower and upper prior bounds, each of shape (p,)."""
    return np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters])
