"""Do the bands mean what they say? Coverage on simulated tests without a missing effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from studies.chen.laboratory import Laboratory
from studies.chen.library import (
    RATE,
    STIFFNESS,
    TABLE_2,
    Array,
    ExactErrors,
    Record,
    band,
    commands,
    fit_residual,
    linear,
    total_band,
)
from studies.chen.published import CHOSEN
from studies.chen.responses import LEVEL, simulate
from studies.chen.scores import coverage

EVALUATIONS = 12_000  # of one case's calibration


@dataclass(frozen=True, slots=True)
class Coverage:
    """Coverage of 95 % bands on one held-out simulated record.

    Attributes:
        glue: share of samples inside the GLUE band.
        total: share of samples inside the total predictive band.
        phi: lag-one correlation of the simulated noise.
        noise: its standard deviation [m].
    """

    glue: float
    total: float
    phi: float
    noise: float


def simulated_case(seed: int) -> Coverage:
    """Calibrate on two simulated sweeps and count coverage on an earthquake-like record.

    Parameters are drawn within 15 % of Table 2 (alpha_3 between 0 and 2 1/s), the noise between
    5 and 50 um, white or AR(1) with phi up to 0.8: nothing is missing from the model.

    Args:
        seed: of parameters, noise and sampler.
    """
    rng = np.random.default_rng([seed, 60])
    theta = TABLE_2 * np.exp(0.15 * rng.standard_normal(4))
    theta[3] = rng.uniform(0.0, 2.0)
    noise = float(np.exp(rng.uniform(np.log(5e-6), np.log(50e-6))))
    phi = float(rng.choice([0.0, rng.uniform(0.2, 0.8)]))

    def test(command: Array, stiffness: float) -> Record:
        shock = rng.standard_normal(len(command))
        shock[1:] *= np.sqrt(1.0 - phi**2)
        disturbance = noise * lfilter([1.0], [1.0, -phi], shock)
        clean = linear.simulate(theta, command, stiffness=stiffness, period=1.0 / RATE)
        return Record(command, clean + disturbance, 1.0 / RATE, stiffness)

    sweep = commands.sweep(RATE)
    records = [test(sweep, stiffness) for stiffness in STIFFNESS]
    new = test(commands.earthquake(RATE, 30.0, 4e-3, seed=seed), STIFFNESS[1])
    errors = ExactErrors(records)
    draws = Laboratory(seed).run((61,), errors, CHOSEN, EVALUATIONS).thinned(400)
    responses = simulate(draws, new)
    residual = [np.asarray(r)[0] for r in errors.residuals(draws.mean(axis=0)[None])]
    model = fit_residual(residual, parameters=4)
    glue, total = (
        coverage(new.measured, *limits.at(LEVEL))
        for limits in (band(responses, [LEVEL]), total_band(rng, responses, model, [LEVEL]))
    )
    return Coverage(glue, total, phi, noise)
