"""Cost of the exact simulation against the number of effects switched on."""

from __future__ import annotations

import time
from statistics import median

import numpy as np

from actuator_glue.model import commands
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

# In the order in which they are added; the first is the nonlinear one of the `kernel` figure.
EFFECTS = (
    'valve-deadband',
    'flow-saturation',
    'coulomb-friction',
    'specimen-hardening',
    'backlash',
    'pressure-flow',
    'viscous-damping',
    'sensor-lag',
)
THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5])


def run(most: int = len(EFFECTS)) -> list[dict[str, float]]:
    """Return ns per theta and sample for 0, 1, .. effects, each a little away from neutral."""
    return [
        {'effects': float(count), 'ns': _cost(Structure(EFFECTS[:count]))}
        for count in range(most + 1)
    ]


def each() -> dict[str, float]:
    """Return ns per theta and sample of every effect of the catalogue alone."""
    return {name: _cost(Structure((name,))) for name in CATALOGUE}


def _cost(structure: Structure, repeats: int = 7, thetas: int = 32) -> float:
    """Processor time of one core per theta and sample [ns], the median of repeats."""
    command = commands.noise(1000.0, 10.0, 0.2, 8.0, seed=0)
    record = Record(command, command, 1e-3, 250e3)
    errors = structure.errors([record])
    theta = np.tile(structure.neutral(THETA), (thetas, 1))
    for j, parameter in enumerate(structure.parameters[4:], start=4):
        neutral = float(theta[0, j])
        end = parameter.upper if neutral < parameter.upper else parameter.lower
        theta[:, j] = neutral + 0.05 * (end - neutral)
    errors(theta)
    taken = []
    for _ in range(repeats):
        began = time.process_time()
        errors(theta)
        taken.append(time.process_time() - began)
    return median(taken) / thetas / len(record) * 1e9
