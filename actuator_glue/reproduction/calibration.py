"""Do the bands mean what they say? Coverage on simulated tests without a missing effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from actuator_glue.inference.bands import band
from actuator_glue.inference.predictive import fit_residual, total_band
from actuator_glue.inference.scores import coverage
from actuator_glue.model import commands, linear
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.model.problem_r import STIFFNESS
from actuator_glue.records import Array, Record
from actuator_glue.reproduction.posterior import Progress, run
from actuator_glue.reproduction.published import CHOSEN

LEVEL = 0.95
RATE = 200.0  # Hz


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


def simulated_case(seed: int, evaluations: int = 12_000) -> Coverage:
    """Calibrate on two simulated sweeps and count coverage on an earthquake-like record.

    Parameters are drawn within 15 % of Table 2 (alpha_3 between 0 and 2 1/s), the noise between
    5 and 50 um, white or AR(1) with phi up to 0.8: nothing is missing from the model.

    Args:
        seed: of parameters, noise and sampler.
        evaluations: likelihood evaluations of the calibration.
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
    draws = run((seed, 61), errors, CHOSEN, evaluations).thinned(400)
    responses = linear.simulate(draws, new.command, stiffness=STIFFNESS[1], period=new.period)
    residual = [np.asarray(r)[0] for r in errors.residuals(draws.mean(axis=0)[None])]
    model = fit_residual(residual, parameters=4)
    shares = []
    for limits in (band(responses, [LEVEL]), total_band(rng, responses, model, [LEVEL])):
        lower, upper = limits.at(LEVEL)
        shares.append(coverage(new.measured, lower, upper))
    return Coverage(shares[0], shares[1], phi, noise)


def study(seeds: Sequence[int], progress: Progress) -> list[Coverage]:
    """Return the coverage of every seed's case."""
    cases = []
    for i, seed in enumerate(seeds):
        cases.append(simulated_case(seed))
        progress((i + 1) / len(seeds))
    return cases
