"""Cost of the exact simulation against the number of effects switched on."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
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
THETAS, SAMPLES = 256, 10_000


# A task is repeated for so long before its time counts: vector units that were idle run at a third
# of their speed for about a millisecond.
_WARM, _COUNTED = 0.005, 0.01  # s


def run(most: int = len(EFFECTS)) -> list[dict[str, float]]:
    """Return ns per theta and sample for 0, 1, .. effects, each a little away from neutral."""
    costs = _costs([Structure(EFFECTS[:count]) for count in range(most + 1)])
    return [{'effects': float(count), 'ns': cost} for count, cost in enumerate(costs)]


def each() -> dict[str, float]:
    """Return ns per theta and sample of every effect of the catalogue alone."""
    costs = _costs([Structure((name,)) for name in CATALOGUE])
    return dict(zip(CATALOGUE, costs, strict=True))


def _costs(structures: Sequence[Structure], repeats: int = 15) -> list[float]:
    """Processor time of one core per theta and sample [ns], medians over repeats in turns."""
    tasks = [_task(structure) for structure in structures]
    taken: list[list[float]] = [[] for _ in tasks]
    for _ in range(repeats):
        for task, times in zip(tasks, taken, strict=True):
            _repeat(task, _WARM)
            times.append(_repeat(task, _COUNTED))
    return [median(times) / THETAS / SAMPLES * 1e9 for times in taken]


def _repeat(task: Callable[[], object], seconds: float) -> float:
    """Do a task for so long at least; return the time of one [s]."""
    began, count = time.process_time(), 0
    while (taken := time.process_time() - began) < seconds or not count:
        task()
        count += 1
    return taken / count


def _task(structure: Structure) -> Callable[[], object]:
    """Return what simulates a batch of parameter sets over a record."""
    command = commands.noise(1000.0, SAMPLES / 1000.0, 0.2, 8.0, seed=0)
    record = Record(command, command, 1e-3, 250e3)
    errors = structure.errors([record])
    theta = np.tile(structure.neutral(THETA), (THETAS, 1))
    for j, parameter in enumerate(structure.parameters[4:], start=4):
        neutral = float(theta[0, j])
        end = parameter.upper if neutral < parameter.upper else parameter.lower
        theta[:, j] = neutral + 0.05 * (end - neutral)
    errors(theta)
    return lambda: errors(theta)
