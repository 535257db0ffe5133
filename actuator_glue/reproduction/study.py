"""The study from data to numbers; figures and pages are made from what it returns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from actuator_glue.model import problem_r
from actuator_glue.model.exact import ExactErrors
from actuator_glue.records import Record
from actuator_glue.reproduction import calibration, misfit, responses, shaping, spread
from actuator_glue.reproduction.experiment import Reading, read_off
from actuator_glue.reproduction.identify import TransferFunction, fit_transfer_function
from actuator_glue.reproduction.physical import (
    Coefficient,
    PhysicalFit,
    coefficients_beside,
    fit_physical,
)
from actuator_glue.reproduction.posterior import Posterior, run
from actuator_glue.reproduction.published import CHOSEN, CLOSE_UPS, SHAPING_FACTORS, SHOWN
from actuator_glue.residual.diagnosis import Diagnosis

# Called with the stage and the share of the whole study that is done.
Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is computed.

    Attributes:
        evaluations: likelihood evaluations of a run that carries a result.
        short: of one run in a series of runs.
        published: of a run as the paper ran it.
        draws: parameter draws per band.
        shaping_factors: G studied.
        added_mm: residuals added for the spread figure [mm].
        seeds: simulated cases of the coverage check.
    """

    evaluations: int
    short: int
    published: int
    draws: int
    shaping_factors: tuple[float, ...]
    added_mm: tuple[float, ...]
    seeds: int


FULL = Effort(
    evaluations=300_000,
    short=60_000,
    published=60_000,
    draws=1000,
    shaping_factors=SHAPING_FACTORS,
    added_mm=(0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.9, 1.0),
    seeds=20,
)
QUICK = Effort(
    evaluations=30_000,
    short=14_000,
    published=10_000,
    draws=300,
    shaping_factors=tuple(SHOWN.values()),
    added_mm=(0.0, 0.2, 0.4, 0.5, 0.6, 0.65, 0.7, 0.75, 0.8),
    seeds=4,
)
NOISE_FREE, NOISY = 'noise-free', 'with sensor noise'


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """Everything the report shows.

    Attributes:
        seed: of the study.
        quick: whether it was the quick one.
        records: tests with k = 0 and k = 250 kN/m, with sensor noise.
        readings: amplitude and phase at 1, 5, 10 Hz, per test.
        identified: transfer functions per test, by NOISE_FREE or NOISY.
        physical: joint fit of Eq. (2) to both tests.
        coefficients: what Table 2 and the joint fit give for the identified coefficients.
        sensor: posterior at G_6 with sensor-level noise.
        table_4: its spread against the residual.
        structures: residuals of other shapes.
        shaped: the shaping factors at sensor-level noise, and with the matched residual.
        choices: the automatic choice of G for each.
        curves: frequency responses without posterior, per test.
        frequency: bands per posterior ('sensor', 'matched') and test.
        time: displacement bands per posterior and 'total', and test.
        refits: structures refitted with and without gain.
        diagnoses: what the diagnosis says of the spring test and of both; none in the quick one.
        covered: coverage on simulated tests.
    """

    seed: int
    quick: bool
    records: tuple[Record, Record]
    readings: tuple[list[Reading], ...]
    identified: dict[str, tuple[TransferFunction, ...]]
    physical: PhysicalFit
    coefficients: list[Coefficient]
    sensor: Posterior
    table_4: spread.Spread
    structures: list[spread.Structure]
    shaped: dict[str, list[shaping.Shaped]]
    choices: dict[str, shaping.Choice]
    curves: tuple[responses.Curves, ...]
    frequency: dict[str, tuple[responses.FrequencyBands, ...]]
    time: dict[str, tuple[responses.TimeBands, ...]]
    refits: list[misfit.Refit]
    diagnoses: dict[str, Diagnosis]
    covered: list[calibration.Coverage]

    @property
    def posteriors(self) -> dict[str, Posterior]:
        """The two posteriors at G_6 that bands are drawn from."""
        return {'sensor': self.sensor, 'matched': self.table_4.matched}


def study(seed: int = 1, *, quick: bool = False, progress: Progress | None = None) -> Results:
    """Run the paper's study on tests reconstructed from Eqs. (3a) and (3b).

    Args:
        seed: of the sensor noise and every sampler; 1 is the problem with a known posterior.
        quick: fewer evaluations, shaping factors and residuals.
        progress: called with the stage and the share done.
    """
    effort = QUICK if quick else FULL
    rng = np.random.default_rng([seed, 1])
    tell = _Stages(progress or (lambda stage, share: None))

    stage = tell('identification', 0.02)
    records = problem_r.records(seed)
    readings = tuple(read_off(r, i, CLOSE_UPS) for i, r in enumerate(records))
    identified = {
        name: tuple(fit_transfer_function(r) for r in tests)
        for name, tests in ((NOISE_FREE, problem_r.records(seed, noise=0.0)), (NOISY, records))
    }
    physical = fit_physical(records)
    errors = ExactErrors(records)

    stage = tell('posterior at G_6', 0.08)
    sensor = run((seed, 30), errors, CHOSEN, effort.evaluations, progress=stage)

    stage = tell('spread against residual', 0.24)
    wide = spread.against_residual(
        seed, errors, effort.added_mm, effort.short, effort.evaluations, stage
    )
    stage = tell('shapes of residual', 0.08)
    structures = spread.structures(seed, records, wide.matched.best_rms, effort.short, stage)

    shaped, choices = {}, {}
    share = 0.20 if quick else 0.10
    for name, added in (('sensor', 0.0), ('matched', wide.matched.added_rms)):
        stage = tell(f'shaping factors, {name} residual', share)
        shaped[name] = shaping.study(
            seed, records, effort.shaping_factors, effort.short, effort.published,
            added_rms=added, draws=min(effort.draws, 400), progress=stage,
        )  # fmt: skip
        choices[name] = shaping.choose(shaped[name])

    stage = tell('bands', 0.06)
    curves = tuple(responses.curves(r, i) for i, r in enumerate(records))
    thetas = {
        'sensor': sensor.thinned(effort.draws),
        'matched': wide.matched.thinned(effort.draws),
    }
    frequency = {
        name: tuple(
            responses.frequency_bands(theta, r, c) for r, c in zip(records, curves, strict=True)
        )
        for name, theta in thetas.items()
    }
    time = {
        name: tuple(responses.time_bands(theta, r) for r in records)
        for name, theta in thetas.items()
    }
    time['total'] = tuple(responses.total_bands(rng, thetas['sensor'], r) for r in records)

    tell('static gain', 0.04)
    refits = misfit.study(records)
    stage = tell('diagnosis', 0.0 if quick else 0.20)
    diagnoses = {} if quick else misfit.diagnoses(seed, records, stage)

    stage = tell('coverage on simulated tests', 0.08)
    seeds = [1000 * seed + i for i in range(effort.seeds)]
    covered = calibration.study(seeds, stage)
    tell('done', 0.0)
    return Results(
        seed, quick, records, readings, identified, physical,
        coefficients_beside(physical.theta), sensor, wide, structures, shaped, choices,
        curves, frequency, time, refits, diagnoses, covered,
    )  # fmt: skip


class _Stages:
    """Turns shares of stages into shares of the study."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._start = 0.0
        self._width = 0.0

    def __call__(self, name: str, width: float) -> Callable[[float], None]:
        start = self._start = self._start + self._width
        self._width = width
        self._progress(name, start)
        return lambda share: self._progress(name, start + share * width)
