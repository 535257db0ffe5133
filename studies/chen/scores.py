"""How good a band or a predictive distribution is: coverage, width, CRPS, interval score."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studies.chen.library import Array, Band, InputError, check_draws

_COLUMNS_AT_ONCE = 4096  # their draws stay in the cache


def coverage(observed: Array, lower: Array, upper: Array) -> float:
    """Return the share of observations (n,) inside the band, in [0, 1] (PICP).

    Raises:
        InputError: different lengths or nothing to count.
    """
    observed, lower, upper = _same_length(observed, lower, upper)
    return float(np.mean((observed >= lower) & (observed <= upper)))


def mean_width(lower: Array, upper: Array) -> float:
    """Return the mean width of a band, in its unit."""
    return float(np.mean(np.asarray(upper) - np.asarray(lower)))


def interval_score(observed: Array, lower: Array, upper: Array, level: float) -> Array:
    """Return the interval score of each sample, shape (n,); smaller is better.

    Width plus 2/(1 - level) times the distance by which an observation misses the band
    (Gneiting & Raftery 2007, Eq. 43); proper for the central band of this level.

    Raises:
        InputError: different lengths, or a level outside (0, 1).
    """
    if not 0.0 < level < 1.0:
        raise InputError(f'band level must lie between 0 and 1, got {level:g}')
    observed, lower, upper = _same_length(observed, lower, upper)
    miss = np.maximum(lower - observed, 0.0) + np.maximum(observed - upper, 0.0)
    return np.asarray((upper - lower) + 2.0 / (1.0 - level) * miss)


def crps_ensemble(observed: Array, draws: Array) -> Array:
    """Return the continuous ranked probability score of each sample, shape (n,).

    E|X - y| - E|X - X'|/2 over the draws (Gneiting & Raftery 2007, Eq. 21), in the
    unit of the draws; smaller is better.

    Args:
        observed: observations, shape (n,).
        draws: one predicted response per row, shape (m, n).

    Raises:
        InputError: see `bands.check_draws`; different lengths.
    """
    draws = check_draws(draws)
    observed = np.asarray(observed, dtype=np.float64)
    if observed.shape != (draws.shape[1],):
        raise InputError(f'{draws.shape[1]} predicted samples but {observed.shape} observed')
    count = len(draws)
    weight = np.full(count, 1.0 / count)
    parts = [
        _crps(
            observed[start : start + _COLUMNS_AT_ONCE],
            draws[:, start : start + _COLUMNS_AT_ONCE],
            weight,
        )
        for start in range(0, len(observed), _COLUMNS_AT_ONCE)
    ]
    return np.concatenate(parts) if parts else np.empty(0)


def _crps(observed: Array, draws: Array, weight: Array) -> Array:
    distance = weight @ np.abs(draws - observed)
    order = np.argsort(draws, axis=0)
    ordered = np.take_along_axis(draws, order, axis=0)
    below = np.cumsum(weight[order], axis=0)
    # E|X - X'| = 2 int F (1 - F) dx, F a staircase with steps at the ordered draws.
    spread = np.sum((below[:-1] * (1.0 - below[:-1])) * np.diff(ordered, axis=0), axis=0)
    return np.asarray(distance - spread)


@dataclass(frozen=True, slots=True)
class Scores:
    """Scores of one band, over one range of frequency.

    Attributes:
        low_hz, high_hz: range of instantaneous frequency [Hz]; 0 and inf for everything.
        samples: how many samples were counted.
        level: nominal coverage of the band.
        coverage: share of the observations inside (PICP).
        mean_width: mean width of the band, in the unit of the observations.
        crps: mean CRPS, same unit; NaN where no draws were given.
        interval_score: mean interval score, same unit.
    """

    low_hz: float
    high_hz: float
    samples: int
    level: float
    coverage: float
    mean_width: float
    crps: float
    interval_score: float


def score(
    observed: Array,
    band: Band,
    level: float = 0.95,
    *,
    crps: Array | None = None,
    frequency_hz: Array | None = None,
    edges_hz: Sequence[float] = (),
) -> list[Scores]:
    """Return the scores of a band over everything, then for each range of frequency.

    Args:
        observed: observations, shape (n,).
        band: band with this level, n samples.
        level: which level of the band to score.
        crps: CRPS of each sample, shape (n,), from `crps_ensemble`.
        frequency_hz: instantaneous frequency of each sample, shape (n,) [Hz].
        edges_hz: ascending edges of the frequency ranges; empty ranges are left out.

    Raises:
        InputError: different lengths, or edges without frequencies.
    """
    lower, upper = band.at(level)
    observed, lower, upper = _same_length(observed, lower, upper)
    if len(edges_hz) and frequency_hz is None:
        raise InputError('scores by frequency band need the frequency of each sample')
    penalty = interval_score(observed, lower, upper, level)

    def part(chosen: NDArray[np.bool_], low: float, high: float) -> Scores:
        return Scores(
            low_hz=low,
            high_hz=high,
            samples=int(np.count_nonzero(chosen)),
            level=level,
            coverage=coverage(observed[chosen], lower[chosen], upper[chosen]),
            mean_width=mean_width(lower[chosen], upper[chosen]),
            crps=float('nan') if crps is None else float(np.mean(crps[chosen])),
            interval_score=float(np.mean(penalty[chosen])),
        )

    scores = [part(np.ones(len(observed), dtype=bool), 0.0, float('inf'))]
    for low, high in pairwise(edges_hz):
        assert frequency_hz is not None
        chosen = (frequency_hz >= low) & (frequency_hz < high)
        if chosen.any():
            scores.append(part(chosen, float(low), float(high)))
    return scores


def _same_length(observed: Array, lower: Array, upper: Array) -> tuple[Array, Array, Array]:
    columns = [np.asarray(c, dtype=np.float64) for c in (observed, lower, upper)]
    shapes = {c.shape for c in columns}
    if len(shapes) != 1 or columns[0].ndim != 1 or not columns[0].size:
        raise InputError(
            f'observed, lower and upper must be equally long and not empty, got shapes '
            f'{[c.shape for c in columns]}'
        )
    return columns[0], columns[1], columns[2]
