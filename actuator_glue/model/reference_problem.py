"""Problem R: the paper's two sweep tests, reconstructed from what its experiment identified."""

from __future__ import annotations

import numpy as np

from actuator_glue.model import commands, linear
from actuator_glue.records import Array, Record

RATE = 200.0  # Hz
STIFFNESS = (0.0, 250e3)  # N/m, the two tests
NOISE = 0.02e-3  # m

# a1, a0, b0 of x/u = b0 / (s^2 + a1 s + a0): the paper's Eqs. (3a) for k = 0, (3b) for 250 kN/m.
EQUATION_3: Array = np.array([[140.0, 4609.0, 4609.0], [133.0, 2101.0, 2208.0]])


def records(
    seed: int = 1, *, noise: float = NOISE, rate: float = RATE, duration: float = 60.0
) -> tuple[Record, Record]:
    """Return the tests with k = 0 and k = 250 kN/m: exact ZOH responses plus white noise.

    Seed 1 with the defaults is the problem whose posterior is known (two sweeps of 12 001
    samples, 0..10 Hz, 2 mm; noise for k = 0 drawn first).

    Args:
        seed: of the noise.
        noise: its standard deviation [m].
        rate: samples per second [Hz].
        duration: length of each sweep [s].

    Raises:
        InputError: unusable rate or duration.
    """
    rng = np.random.default_rng(seed)
    u = commands.sweep(rate, duration)
    first, second = (
        Record(
            u,
            linear.respond(system[np.newaxis], u, period=1.0 / rate)[0]
            + noise * rng.standard_normal(len(u)),
            1.0 / rate,
            stiffness,
            source=f'problem R, k = {stiffness / 1e3:g} kN/m',
        )
        for system, stiffness in zip(EQUATION_3, STIFFNESS, strict=True)
    )
    return first, second
