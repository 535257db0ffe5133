"""Cost of the exact simulation against the number of effects switched on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from actuator_glue.model import commands
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.effects.terms.entry import term
from actuator_glue.model.parameters import Parameter
from actuator_glue.model.structure import Structure
from actuator_glue.model.structure_errors import StructureErrors
from actuator_glue.records import Record
from benchmarks.turns import in_turns

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
# Expressions, bounds and neutral value of their parameter, and the built-in effect that does the
# same or, where there is none, the like of it at that place.
WRITTEN = {
    'valve: e = dead(e, own)': ((0.0, 2e-3, 0.0), 'valve-deadband'),
    'valve: e = tanh(own*e)/own': ((0.0, 1e4, 0.0), 'valve-deadband'),
    'flow: q = q*(1 + own*sign(q))': ((-0.6, 0.6, 0.0), 'flow-asymmetry'),
    'flow: q = q*sqrt(max(1 - sign(q)*f*own, 0))': ((0.0, 0.01, 0.0), 'pressure-flow'),
    'specimen: f = f + k*own*x**3': ((-3e5, 3e6, 0.0), 'specimen-hardening'),
    'force: f = f + own*tanh(v/1e-2)': ((0.0, 2e4, 0.0), 'stribeck-friction'),
    'sensor: y = y + own*y**3': ((-5e5, 5e5, 0.0), 'backlash'),
}
THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5])
THETAS, SAMPLES = 256, 10_000


def run(most: int = len(EFFECTS)) -> list[dict[str, float | None]]:
    """Return ns per theta and sample for 0, 1, .. effects, each a little away from neutral.

    `ns` over all repeats, `whole_core_ns` over those with a whole core (see `turns`).
    """
    costs = _costs({str(count): Structure(EFFECTS[:count]) for count in range(most + 1)})
    return [{'effects': float(count), **cost} for count, cost in costs.items()]


def each() -> dict[str, dict[str, float | None]]:
    """Return the same of every effect of the catalogue alone, by its name."""
    return _costs({name: Structure((name,)) for name in CATALOGUE})


def written(
    expressions: Iterable[str] = tuple(WRITTEN), repeats: int = 15
) -> dict[str, dict[str, float]]:
    """Return the same of expressions and of the built-in effects beside them, and the ratio."""
    found = {}
    for equation in expressions:
        (lower, upper, neutral), name = WRITTEN[equation]
        own = term('own', equation, (Parameter('own', '1', lower, upper, '', neutral),))
        tasks = {'ns': _task(Structure((own,))), 'built_in_ns': _task(Structure((name,)))}
        taken = {key: _ns(taken.median) for key, taken in in_turns(tasks, repeats).items()}
        found[equation] = {**taken, 'ratio': taken['ns'] / taken['built_in_ns']}
    return found


def _costs(structures: Mapping[str, Structure]) -> dict[str, dict[str, float | None]]:
    tasks = {name: _task(structure) for name, structure in structures.items()}
    return {
        name: {
            'ns': _ns(taken.median),
            'whole_core_ns': None if taken.whole is None else _ns(taken.whole),
        }
        for name, taken in in_turns(tasks, 15).items()
    }


def _ns(seconds: float) -> float:
    return seconds / THETAS / SAMPLES * 1e9


def _task(structure: Structure) -> Callable[[], object]:
    """Return what simulates a batch of parameter sets over a record."""
    command = commands.noise(1000.0, SAMPLES / 1000.0, 0.2, 8.0, seed=0)
    record = Record(command, command, 1e-3, 250e3)
    errors = StructureErrors(structure, [record])
    theta = np.tile(structure.neutral(THETA), (THETAS, 1))
    for j, parameter in enumerate(structure.parameters[4:], start=4):
        neutral = float(theta[0, j])
        end = parameter.upper if neutral < parameter.upper else parameter.lower
        theta[:, j] = neutral + 0.05 * (end - neutral)
    errors(theta)
    return lambda: errors(theta)
