"""A diagnosis of three one-minute records at 1 kHz with the whole catalogue, on two cores."""

from __future__ import annotations

import time

import numpy as np

from actuator_glue.api.diagnosis import diagnose
from actuator_glue.model import commands
from actuator_glue.model.stream import Stream
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

RATE = 1000.0
THETA = np.array([134.0, 1.1e9, 2.5e5, 0.5])


def _records() -> list[Record]:
    structure = Structure(('valve-deadband',))
    theta: Array = structure.neutral(THETA)
    deadband = structure.parameters[4]
    theta[4] = 0.2 * deadband.upper
    rng = np.random.default_rng(5)
    inputs = (
        commands.sweep(RATE, 60.0),
        commands.noise(RATE, 60.0, 0.2, 8.0, seed=6),
        commands.earthquake(RATE, 60.0, seed=7),
    )
    records = []
    for command, stiffness in zip(inputs, (0.0, 250e3, 250e3), strict=True):
        plant = Stream(
            structure, theta, stiffness=stiffness, period=1.0 / RATE, rng=rng, noise_stddev=3e-6
        )
        measured, _ = plant.step(command)
        records.append(Record(command, measured, 1.0 / RATE, stiffness))
    return records


def run(jobs: int = 2) -> dict[str, float]:
    """Return the `diagnosis` figures of bench.json."""
    records = _records()
    began = time.perf_counter()
    diagnose(records, seed=1, jobs=jobs)
    return {'seconds_1khz': time.perf_counter() - began}
