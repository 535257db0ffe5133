"""Records and parameters that tests of structures share."""

from __future__ import annotations

import numpy as np

from actuator_glue.model import linear
from actuator_glue.model.commands import sweep
from actuator_glue.model.effects import CATALOGUE, scale
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.structure import Structure
from actuator_glue.records import Record

RATE = 256.0
U = sweep(RATE, duration=8.0, f0=0.0, f1=10.0, amplitude=2e-3)
EVERY = tuple(CATALOGUE)
MANY = (
    'delay',
    'gain',
    'valve-lag',
    'valve-deadband',
    'flow-asymmetry',
    'supply-droop',
    'stribeck-friction',
    'specimen-yield',
    'sensor-lag',
    'backlash',
    'clock-skew',
    'bias',
    'hum',
)


def record(stiffness: float = 250e3, hold: str = 'zoh', rate: float = RATE) -> Record:
    """Return a record whose measured displacement is Eq. (2)'s."""
    step = round(rate / RATE) if rate > RATE else 1
    u = np.repeat(U, step) if step > 1 else U
    x = linear.simulate(TABLE_2, u, stiffness=stiffness, period=1.0 / rate, hold=hold)
    return Record(u, x, 1.0 / rate, stiffness, hold=hold)


def typical(names: tuple[str, ...], r: Record, which: int = 0) -> np.ndarray:
    """Return theta with every named effect at one of its typical sizes."""
    structure = Structure(names)
    theta = structure.neutral(TABLE_2)
    size = scale([r], TABLE_2)
    for name in names:
        starts = Structure((name,)).starts(TABLE_2, size)
        theta[structure.columns(name)] = starts[which % len(starts), 4:]
    return theta
