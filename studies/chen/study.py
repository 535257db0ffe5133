"""The study from data to numbers; tables, figures and prose are made from what it returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.chen import misfit, responses, shaping, table_spread
from studies.chen.calibration import EVALUATIONS, Coverage, simulated_case
from studies.chen.experiment import Complex, Reading, read_off
from studies.chen.identify import (
    PhysicalFit,
    TransferFunction,
    fit_physical,
    fit_transfer_function,
)
from studies.chen.laboratory import Laboratory, Posterior, Progress
from studies.chen.library import Diagnosis, ExactErrors, Record, diagnose, reconstructed_tests
from studies.chen.published import CHOSEN, SHAPING_FACTORS, SHOWN


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
        diagnosis: what the diagnosis takes, in evaluations of about the same time; 0 for none.
    """

    evaluations: int
    short: int
    published: int
    draws: int
    shaping_factors: tuple[float, ...]
    added_mm: tuple[float, ...]
    seeds: int
    diagnosis: int

    @property
    def total(self) -> int:
        """Evaluations of the whole study, or work worth as many."""
        runs = len(self.added_mm) + 1 + 7 + 4 * len(self.shaping_factors)
        return (
            2 * self.evaluations
            + runs * self.short
            + self.diagnosis
            + 2 * len(self.shaping_factors) * self.published
            + self.seeds * EVALUATIONS
        )


FULL = Effort(
    evaluations=300_000,
    short=60_000,
    published=60_000,
    draws=1000,
    shaping_factors=SHAPING_FACTORS,
    added_mm=(0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.9, 1.0),
    seeds=20,
    diagnosis=2_000_000,
)
QUICK = Effort(
    evaluations=30_000,
    short=14_000,
    published=10_000,
    draws=300,
    shaping_factors=tuple(SHOWN.values()),
    added_mm=(0.0, 0.2, 0.4, 0.5, 0.6, 0.65, 0.7, 0.75, 0.8),
    seeds=4,
    diagnosis=0,
)
NOISE_FREE, NOISY = 'noise-free', 'with sensor noise'


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """Everything the report shows; "per test" is k = 0, then k = 250 kN/m.

    Attributes:
        seed: of the study.
        quick: whether it was the quick one.
        records: the tests, with sensor noise.
        readings: amplitude and phase at 1, 5, 10 Hz, per test.
        identified: transfer functions per test, by NOISE_FREE or NOISY.
        physical: joint fit of Eq. (2) to both tests.
        sensor: posterior at G_6 with sensor-level noise.
        table_4: its spread against the residual.
        shapes: posteriors with residuals of other shapes.
        shaped: the shaping factors at sensor-level noise, and with the matched residual.
        choices: the automatic choice of G for each.
        curves: frequency responses without posterior, per test.
        frequency: bands per posterior ('sensor', 'matched'), test and quantity.
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
    sensor: Posterior
    table_4: table_spread.Spread
    shapes: dict[str, Posterior]
    shaped: dict[str, list[shaping.Shaped]]
    choices: dict[str, shaping.Choice]
    curves: tuple[dict[str, Complex], ...]
    frequency: dict[str, tuple[dict[str, responses.FrequencyBand], ...]]
    time: dict[str, tuple[responses.TimeBand, ...]]
    refits: dict[str, misfit.Refit]
    diagnoses: dict[str, Diagnosis]
    covered: list[Coverage]

    @property
    def posteriors(self) -> dict[str, Posterior]:
        """The two posteriors at G_6 that bands are drawn from."""
        return {'sensor': self.sensor, 'matched': self.table_4.matched}

    def shown(self, kind: str) -> dict[str, shaping.Shaped]:
        """Return the shaping factors G_1, G_6 and G_8 of one kind of residual."""
        by_factor = {s.shaping_factor: s for s in self.shaped[kind]}
        return {name: by_factor[factor] for name, factor in SHOWN.items()}


def study(seed: int = 1, *, quick: bool = False, progress: Progress | None = None) -> Results:
    """Run the paper's study on tests reconstructed from Eqs. (3a) and (3b).

    Args:
        seed: of the sensor noise and every sampler; 1 is the problem with a known posterior.
        quick: fewer evaluations, shaping factors and residuals.
        progress: called with the stage and the share done.
    """
    effort = QUICK if quick else FULL
    laboratory = Laboratory(seed, effort.total, progress or (lambda stage, share: None))

    laboratory.enter('identification')
    records = reconstructed_tests(seed)
    readings = tuple(read_off(r, i) for i, r in enumerate(records))
    identified = {
        name: tuple(fit_transfer_function(r) for r in tests)
        for name, tests in ((NOISE_FREE, reconstructed_tests(seed, noise=0.0)), (NOISY, records))
    }
    physical = fit_physical(records)
    errors = ExactErrors(records)

    laboratory.enter('posterior at G_6')
    sensor = laboratory.run((30,), errors, CHOSEN, effort.evaluations)
    laboratory.enter('spread against residual')
    wide = table_spread.against_residual(
        laboratory, errors, effort.added_mm, effort.short, effort.evaluations
    )
    laboratory.enter('shapes of residual')
    shapes = table_spread.shapes(laboratory, records, wide.matched.best_rms, effort.short)

    shaped = {}
    for name, added in (('sensor', 0.0), ('matched', wide.matched.added_rms)):
        laboratory.enter(f'shaping factors, {name} residual')
        shaped[name] = shaping.study(
            laboratory,
            records,
            effort.shaping_factors,
            (effort.short, effort.published),
            added_rms=added,
            draws=min(effort.draws, 400),
        )

    laboratory.enter('bands')
    thetas = {
        'sensor': sensor.thinned(effort.draws),
        'matched': wide.matched.thinned(effort.draws),
    }
    curves = tuple(responses.curves(r, i) for i, r in enumerate(records))
    frequency = {
        name: tuple(
            responses.frequency_bands(theta, r, c['experiment'])
            for r, c in zip(records, curves, strict=True)
        )
        for name, theta in thetas.items()
    }
    time = {n: tuple(responses.time_band(t, r) for r in records) for n, t in thetas.items()}
    rng = np.random.default_rng([seed, 1])
    time['total'] = tuple(responses.total_time_band(rng, thetas['sensor'], r) for r in records)

    laboratory.enter('static gain')
    refits = misfit.study(records)
    diagnoses = {}
    if effort.diagnosis:
        laboratory.enter('diagnosis')
        diagnoses['spring test alone'] = diagnose(records[1:], seed=seed)
        laboratory.add(effort.diagnosis // 3)
        diagnoses['both tests'] = diagnose(records, seed=seed)
        laboratory.add(effort.diagnosis - effort.diagnosis // 3)

    laboratory.enter('coverage on simulated tests')
    covered = []
    for i in range(effort.seeds):
        covered.append(simulated_case(1000 * seed + i))
        laboratory.add(EVALUATIONS)
    return Results(
        seed,
        quick,
        records,
        readings,
        identified,
        physical,
        sensor,
        wide,
        shapes,
        shaped,
        {kind: shaping.choose(entries) for kind, entries in shaped.items()},
        curves,
        frequency,
        time,
        refits,
        diagnoses,
        covered,
    )
