"""Two short tests before the stream: what they tell of the actuator is carried on to it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import actuator_glue as ag
from actuator_glue.api.simulation import Command
from actuator_glue.records import Array

# Quicker than real time: they are simulated, like the actuator itself.
SECONDS = 20.0
EVALUATIONS = 20_000


def calibrate(
    truth: Array,
    stiffness: float,
    rate: float,
    seed: int,
    path: Path,
    tell: Callable[[float], None],
) -> Path:
    """Calibrate the sound actuator free and with its specimen, as the paper does; save it.

    Args:
        truth: true parameters of Eq. (2), shape (4,).
        stiffness: specimen stiffness of the second test [N/m].
        rate: samples per second [Hz].
        seed: seed of noise and sampler.
        path: gets the calibration.
        tell: called with the share that is done.
    """
    records = [
        ag.simulate(
            Command(duration=SECONDS, rate=rate), stiffness=k, theta=truth, seed=(seed, number)
        )
        for number, k in enumerate((0.0, stiffness or 250e3), start=100)
    ]
    found = ag.calibrate(
        records,
        evaluations=EVALUATIONS,
        seed=seed,
        progress=lambda made: tell(made / EVALUATIONS),
    )
    return found.save(path)
