"""The transfer system of the RTHS benchmark: a realistic plant that Eq. (2) only approximates.

Silva et al. (2020), Mechanical Systems and Signal Processing 135:106381, problem statement V23.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.model.plant import MeasuredPlant, StateSpacePlant
from actuator_glue.model.sensor import SensorSpec
from actuator_glue.records import Hold

RATE = 4096.0  # Hz
STROKE = 7e-3  # m
FORCE = 8.9e3  # N, rated
DISPLACEMENT_SENSOR = SensorSpec(noise=16e-6, bits=18, span=STROKE)
FORCE_SENSOR = SensorSpec(noise=2.2, bits=18, span=FORCE)


@dataclass(frozen=True, slots=True)
class BenchmarkParameters:
    """Parameters of the benchmark's transfer system and experimental substructure.

    Attributes:
        a1_beta0: servo-valve and oil gain [m Pa/s].
        a2: actuator velocity feedback [m Pa].
        a3: leakage pole [1/s].
        beta1: servo-valve damping [1/s].
        beta2: servo-valve stiffness [1/s^2].
        mass: experimental mass [kg].
        damping: experimental damping [kg/s].
        stiffness: experimental stiffness [N/m].
    """

    a1_beta0: float = 2.13e13
    a2: float = 4.23e6
    a3: float = 3.3
    beta1: float = 425.0
    beta2: float = 1e5
    mass: float = 29.1
    damping: float = 114.6
    stiffness: float = 1.19e6

    def drawn(self, rng: np.random.Generator) -> BenchmarkParameters:
        """Return parameters drawn as the benchmark's robustness test does.

        Those that it gives a standard deviation are normal (a3 1.3, beta1 3.3, beta2 3.31e3,
        stiffness 5e4) and kept positive.
        """
        spread = {'a3': 1.3, 'beta1': 3.3, 'beta2': 3.31e3, 'stiffness': 5e4}
        drawn = {
            name: max(float(rng.normal(getattr(self, name), sd)), 1e-3 * getattr(self, name))
            for name, sd in spread.items()
        }
        return replace(self, **drawn)


def benchmark_plant(
    parameters: BenchmarkParameters | None = None,
    *,
    period: float = 1.0 / RATE,
    hold: Hold = 'zoh',
    seed: int = 0,
    displacement: SensorSpec = DISPLACEMENT_SENSOR,
    force: SensorSpec = FORCE_SENSOR,
) -> MeasuredPlant:
    """Return the benchmark's transfer system with its sensors.

    Unity displacement feedback around a second-order servo-valve, actuator pressure with leakage
    a3 and natural velocity feedback a2, and the experimental mass, damper and spring. Commands
    beyond the stroke of 7 mm are held there, as the controller does.

    Args:
        parameters: nominal ones if None.
        period: sample period [s].
        hold: how the command runs between its samples.
        seed: seeds the sensors' noise.
        displacement: displacement sensor [m].
        force: force sensor [N].

    Raises:
        InputError: period not in (0, 1] s, or a parameter that is not positive and finite.
    """
    p = parameters or BenchmarkParameters()
    if not 0.0 < period <= 1.0:
        raise InputError(f'sample period {period:g} s is outside (0, 1] s')
    for name in p.__slots__:
        if not (np.isfinite(getattr(p, name)) and getattr(p, name) > 0.0):
            raise InputError(f'benchmark parameter {name} = {getattr(p, name)} is not positive')
    # State: valve flow q and its rate, actuator force f, displacement x, velocity v.
    A = np.array(
        [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [-p.beta2, -p.beta1, 0.0, -p.a1_beta0, 0.0],
            [1.0, 0.0, -p.a3, 0.0, -p.a2],
            [0.0, 0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 1.0 / p.mass, -p.stiffness / p.mass, -p.damping / p.mass],
        ]
    )
    B = np.array([0.0, p.a1_beta0, 0.0, 0.0, 0.0])
    C = np.array([[0.0, 0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]])
    plant = StateSpacePlant(A, B, C, period, hold, stroke=STROKE)
    return MeasuredPlant(plant, displacement, force, seed)
