"""What a posterior predicts: bands of frequency response and displacement, and their coverage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.bands import Band, band
from actuator_glue.inference.predictive import fit_residual, predictive_draws, total_band
from actuator_glue.inference.scores import Scores, coverage, crps_ensemble, score
from actuator_glue.model import linear
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.records import Array, Record
from actuator_glue.report.timeseries import Zoom
from actuator_glue.reproduction.experiment import (
    Complex,
    empirical_response,
    identified_response,
)
from actuator_glue.reproduction.published import CLOSE_UPS
from actuator_glue.reproduction.shaping import blocks

LEVEL = 0.95
GRID = np.linspace(0.2, 10.0, 99)  # Hz; below, a sweep of 60 s holds no whole cycle
EDGES = (0.0, 2.0, 4.0, 6.0, 8.0, 10.01)  # Hz, ranges that scores are given for
SWEEP_RATE = 10.0 / 60.0  # Hz/s
SPAN = 0.5  # Hz to each side that counts as "near" a frequency (Figs. 8, 9)


def decibel(response: Complex) -> Array:
    """Return the amplitude of a complex response [dB]."""
    return np.asarray(20.0 * np.log10(np.abs(response)))


def phase(response: Complex) -> Array:
    """Return the phase of complex responses of a lag [rad], in (-2 pi, 0] at these frequencies."""
    turned = np.angle(response)
    return np.asarray(np.where(turned > 0.5, turned - 2.0 * np.pi, turned))


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyBands:
    """Amplitude and phase of one test under one posterior (Figs. 7, 10, 11).

    Attributes:
        amplitude, phase: draws at `GRID`, shape (m, nf) [dB], [rad].
        close_amplitude, close_phase: draws at 1, 5, 10 Hz, shape (m, 3).
        coverage: share of the experimental curve inside, by quantity and kind of band:
            keys ('amplitude' or 'phase', '95 %' or 'all draws').
    """

    amplitude: Array
    phase: Array
    close_amplitude: Array
    close_phase: Array
    coverage: dict[tuple[str, str], float]


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Frequency responses of one test that no posterior enters, at `GRID` and 1, 5, 10 Hz.

    Attributes:
        experiment: read off the reconstructed record, complex, shape (nf,).
        identified: Eq. (3a) or (3b), which the paper calls the deterministic model, (nf,).
        table_2: Eq. (2) with Table 2, (nf,).
        close_experiment, close_identified, close_table_2: the same at 1, 5, 10 Hz, (3,).
    """

    experiment: Complex
    identified: Complex
    table_2: Complex
    close_experiment: Complex
    close_identified: Complex
    close_table_2: Complex


def curves(record: Record, test: int) -> Curves:
    """Return the experimental and deterministic frequency responses of one test."""
    close = np.array(CLOSE_UPS)
    stiffness = record.known_stiffness()
    return Curves(
        empirical_response(record, test, GRID),
        identified_response(test, GRID),
        linear.frequency_response(TABLE_2, stiffness, GRID),
        empirical_response(record, test, close),
        identified_response(test, close),
        linear.frequency_response(TABLE_2, stiffness, close),
    )


def frequency_bands(theta: Array, record: Record, reference: Curves) -> FrequencyBands:
    """Return frequency responses of theta (m, 4) and how much of the experiment they cover."""
    stiffness = record.known_stiffness()
    wide = linear.frequency_response(theta, stiffness, GRID)
    close = linear.frequency_response(theta, stiffness, np.array(CLOSE_UPS))
    covered = {}
    for name, of in (('amplitude', decibel), ('phase', phase)):
        draws, experiment = of(wide), of(reference.experiment)
        lower, upper = band(draws, [LEVEL]).at(LEVEL)
        covered[name, '95 %'] = coverage(experiment, lower, upper)
        covered[name, 'all draws'] = coverage(experiment, draws.min(axis=0), draws.max(axis=0))
    return FrequencyBands(decibel(wide), phase(wide), decibel(close), phase(close), covered)


@dataclass(frozen=True, slots=True, eq=False)
class TimeBands:
    """Displacement of one test under one posterior (Figs. 8, 9).

    Attributes:
        limits: 95 % GLUE band [m].
        near: share of measured samples inside it near 1, 5, 10 Hz, shape (3,).
        scores: over everything, then by range of frequency (held-out blocks where a total band
            is fitted on the others).
    """

    limits: Band
    near: Array
    scores: list[Scores]


def near(record: Record, frequency_hz: float) -> slice:
    """Return the samples within half a hertz of a frequency of the sweep."""
    low, high = ((frequency_hz + side) / SWEEP_RATE for side in (-SPAN, SPAN))
    start, stop = np.searchsorted(record.time, (low, high))
    return slice(int(start), int(stop))


def zooms() -> list[Zoom]:
    """Return time spans [s] of two cycles about 1, 5 and 10 Hz of the sweep."""
    spans = []
    for frequency in CLOSE_UPS:
        length = 2.0 / frequency
        start = min(frequency / SWEEP_RATE - length / 2.0, 60.0 - length)
        spans.append((start, start + length))
    return spans


def time_bands(theta: Array, record: Record) -> TimeBands:
    """Return the GLUE band of the displacement for theta (m, 4) and its scores."""
    responses = simulate(theta, record)
    limits = band(responses, [LEVEL])
    return TimeBands(limits, _near(record, limits), _scores(record, limits, responses))


def total_bands(rng: np.random.Generator, theta: Array, record: Record) -> TimeBands:
    """Return the total predictive band: theta (m, 4) plus a residual model.

    The residual model is estimated on alternate blocks; the scores are those of the others.
    """
    responses = simulate(theta, record)
    residual = record.measured - responses.mean(axis=0)
    _, held = blocks(record)
    keep = np.ones(len(record), dtype=np.bool_)
    for part in held:
        keep[part] = False
    # Cut where a held-out block was, so that phi is not estimated across the seam.
    kept = np.split(residual, np.flatnonzero(np.diff(keep)) + 1)[0::2]
    model = fit_residual(kept, parameters=theta.shape[1])
    limits = total_band(rng, responses, model, [LEVEL])
    paths = predictive_draws(rng, responses, model)
    return TimeBands(limits, _near(record, limits), _scores(record, limits, paths, ~keep))


def simulate(theta: Array, record: Record) -> Array:
    """Return responses of theta (m, 4) to a record's command, shape (m, n) [m]."""
    return linear.simulate(
        theta, record.command, stiffness=record.known_stiffness(),
        period=record.period, hold=record.hold,
    )  # fmt: skip


def _near(record: Record, limits: Band) -> Array:
    lower, upper = limits.at(LEVEL)
    parts = [near(record, f) for f in CLOSE_UPS]
    return np.array([coverage(record.measured[p], lower[p], upper[p]) for p in parts])


def _scores(
    record: Record, limits: Band, draws: Array, counted: NDArray[np.bool_] | None = None
) -> list[Scores]:
    chosen = np.ones(len(record), dtype=np.bool_) if counted is None else counted
    cut = Band(
        limits.levels, limits.lower[:, chosen], limits.median[chosen], limits.upper[:, chosen]
    )
    observed = record.measured[chosen]
    return score(
        observed, cut, LEVEL, crps=crps_ensemble(observed, draws[:, chosen]),
        frequency_hz=record.time[chosen] * SWEEP_RATE, edges_hz=EDGES,
    )  # fmt: skip
