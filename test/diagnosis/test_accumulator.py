"""An accumulator that empties in strong motion is named, and told from a droop of the supply."""

import numpy as np
import pytest

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.model.commands import noise
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 200.0
THETA = np.array([190.0, 4.5e9, 6e5, 1.5])
DEPLETION, PUMP = 4.0, 0.022


def record(stiffness: float, seed: int) -> Record:
    """Return 25 s of motion that grows and fades; under 12 um of noise."""
    command = noise(RATE, 25.0, 0.2, 5.0, 6e-3, seed=seed)
    command *= np.sin(np.linspace(0.0, np.pi, len(command))) ** 2
    rest = Record(command, command, 1.0 / RATE, stiffness)
    moved = Structure(('accumulator-depletion',)).simulate(
        np.array([*THETA, DEPLETION, PUMP]), rest
    )
    moved = moved + 12e-6 * np.random.default_rng(seed).standard_normal(len(command))
    return Record(command, moved, 1.0 / RATE, stiffness, source=f'{seed}.csv')


@pytest.mark.slow
def test_an_accumulator_that_empties_is_named() -> None:
    """With the rate of the pump, and nothing else beside it."""
    found = diagnose([record(0.0, 1), record(4e5, 2)], record(4e5, 3), seed=1)
    assert [e.name for e in found.effects] == ['accumulator-depletion']
    (sizes,) = (e.parameters for e in found.effects)
    assert sizes['depletion'].lower <= DEPLETION <= sizes['depletion'].upper
    assert sizes['pump_velocity'].lower <= PUMP <= sizes['pump_velocity'].upper
    assert found.error.after < 1.05 * found.error.noise_floor < found.error.before
