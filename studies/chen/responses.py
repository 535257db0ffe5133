"""What a posterior predicts: bands of frequency response and displacement, and their coverage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.chen.experiment import (
    Complex,
    blocks,
    empirical_response,
    frequencies,
    identified_response,
    near,
)
from studies.chen.library import (
    TABLE_2,
    Array,
    Band,
    Record,
    band,
    fit_residual,
    linear,
    predictive_draws,
    total_band,
)
from studies.chen.published import CLOSE_UPS
from studies.chen.scores import Scores, coverage, crps_ensemble, score

LEVEL = 0.95
GRID = np.linspace(0.2, 10.0, 99)  # Hz; below, a sweep of 60 s holds no whole cycle
CLOSE = [int(np.argmin(np.abs(GRID - f))) for f in CLOSE_UPS]  # where the close-ups stand in it
EDGES = (0.0, 2.0, 4.0, 6.0, 8.0, 10.01)  # Hz, ranges that scores are given for
UNITS = {'amplitude': 'dB', 'phase': 'rad'}
QUANTITIES = tuple(UNITS)


def simulate(theta: Array, record: Record) -> Array:
    """Return responses of theta (m, 4) to a record's command, shape (m, n) [m]."""
    return linear.simulate(
        theta,
        record.command,
        stiffness=record.known_stiffness(),
        period=record.period,
        hold=record.hold,
    )


def quantity(name: str, response: Complex) -> Array:
    """Return the 'amplitude' [dB] or 'phase' [rad] of responses of a lag, in (-2 pi, 0.5]."""
    if name == 'amplitude':
        return np.asarray(20.0 * np.log10(np.abs(response)))
    turned = np.angle(response)
    return np.asarray(np.where(turned > 0.5, turned - 2.0 * np.pi, turned))


def curves(record: Record, test: int) -> dict[str, Complex]:
    """Return a test's frequency responses at `GRID` that no posterior enters, each (nf,).

    Keys: 'experiment', read off the record; 'identified', Eq. (3a) or (3b), which the paper calls
    the deterministic model; 'Table 2', Eq. (2) with Table 2.
    """
    return {
        'experiment': empirical_response(record, test, GRID),
        'identified': identified_response(test, GRID),
        'Table 2': linear.frequency_response(TABLE_2, record.known_stiffness(), GRID),
    }


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyBand:
    """Amplitude [dB] or phase [rad] of one test under one posterior (Figs. 7, 10, 11).

    Attributes:
        draws: at `GRID`, shape (m, nf).
        limits: 95 % band.
        inside: where the experiment lies inside it, shape (nf,).
        inside_all: where it lies between the outermost draws, shape (nf,).
    """

    draws: Array
    limits: Band
    inside: NDArray[np.bool_]
    inside_all: NDArray[np.bool_]

    def close(self, at: int) -> Array:
        """Return the draws at one of the close-ups, shape (m,)."""
        return np.asarray(self.draws[:, CLOSE[at]])

    @property
    def mean_width(self) -> float:
        """Mean width of the 95 % band [dB] or [rad]."""
        lower, upper = self.limits.at(LEVEL)
        return float(np.mean(upper - lower))


def frequency_bands(theta: Array, record: Record, experiment: Complex) -> dict[str, FrequencyBand]:
    """Return the bands of theta (m, 4) by quantity, beside the experiment's response (nf,)."""
    responses = linear.frequency_response(theta, record.known_stiffness(), GRID)
    found = {}
    for name in QUANTITIES:
        draws, measured = quantity(name, responses), quantity(name, experiment)
        limits = band(draws, [LEVEL])
        lower, upper = limits.at(LEVEL)
        within = (measured >= lower) & (measured <= upper)
        within_all = (measured >= draws.min(axis=0)) & (measured <= draws.max(axis=0))
        found[name] = FrequencyBand(draws, limits, within, within_all)
    return found


@dataclass(frozen=True, slots=True, eq=False)
class TimeBand:
    """Displacement of one test under one posterior (Figs. 8, 9).

    Attributes:
        limits: 95 % band [m].
        near: share of measured samples inside it near 1, 5, 10 Hz, shape (3,).
        scores: over everything, then by range of frequency (held-out blocks where a total band
            is fitted on the others).
    """

    limits: Band
    near: Array
    scores: list[Scores]


def time_band(theta: Array, record: Record) -> TimeBand:
    """Return the GLUE band of the displacement for theta (m, 4) and its scores."""
    responses = simulate(theta, record)
    return _scored(record, band(responses, [LEVEL]), responses)


def total_time_band(rng: np.random.Generator, theta: Array, record: Record) -> TimeBand:
    """Return the total predictive band: theta (m, 4) plus a residual model.

    The residual model is estimated on alternate blocks; the scores are those of the others.
    """
    responses = simulate(theta, record)
    residual = record.measured - responses.mean(axis=0)
    held_out = blocks(record)[1]
    # Cut where a held-out block was, so that phi is not estimated across the seam.
    kept = np.split(residual, np.flatnonzero(np.diff(held_out)) + 1)[0::2]
    model = fit_residual(kept, parameters=theta.shape[1])
    limits = total_band(rng, responses, model, [LEVEL])
    return _scored(record, limits, predictive_draws(rng, responses, model), held_out)


def _scored(
    record: Record, limits: Band, draws: Array, counted: NDArray[np.bool_] | None = None
) -> TimeBand:
    lower, upper = limits.at(LEVEL)
    parts = [near(record, f) for f in CLOSE_UPS]
    inside = [coverage(record.measured[p], lower[p], upper[p]) for p in parts]
    chosen = np.ones(len(record), dtype=np.bool_) if counted is None else counted
    cut = Band(
        limits.levels, limits.lower[:, chosen], limits.median[chosen], limits.upper[:, chosen]
    )
    observed = record.measured[chosen]
    scores = score(
        observed,
        cut,
        LEVEL,
        crps=crps_ensemble(observed, draws[:, chosen]),
        frequency_hz=frequencies(record)[chosen],
        edges_hz=EDGES,
    )
    return TimeBand(limits, np.array(inside), scores)
