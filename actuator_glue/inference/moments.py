"""Posterior moments as in the paper's Table 4, and which parameters the data do not determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator_glue.errors import InputError
from actuator_glue.records import Array

# A posterior this wide beside its prior (ratio of standard deviations) is mostly prior: the data
# moved the parameter by less than ln 4 = 1.4 nats. Along the ridge of a single test, where only a
# combination is identified, the ratio lies between 0.3 and 1; where a test identifies a parameter
# it is below 0.05.
PRIOR_DOMINATED = 0.25
# Share of a parameter's variance that may come from parameters that the data do not determine.
# Their truth may lie three standard deviations off, in a corner of the box: with a tenth that
# moves this parameter by one of its own.
_BORNE = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Moments of each parameter; every array (p,), physical units.

    Attributes:
        mean: mean.
        stddev: standard deviation (divisor m).
        skewness: third standardised moment (divisor m).
        cov: coefficient of variation, stddev / |mean|; infinite for a mean of zero.
        prior_dominated: True where the draws are about as wide as the prior, or move with those of
            such a parameter: the data then determine a combination of both only.
        best: the draw of the largest log likelihood; None where none was given.
    """

    mean: Array
    stddev: Array
    skewness: Array
    cov: Array
    prior_dominated: NDArray[np.bool_]
    best: Array | None = None


def moments(
    draws: Array,
    lower: ArrayLike,
    upper: ArrayLike,
    *,
    log_density: Array | None = None,
) -> Moments:
    """Return the moments of posterior draws.

    Args:
        draws: (m, p) [physical units].
        lower: lower bounds of the uniform prior, (p,).
        upper: upper bounds, (p,).
        log_density: log likelihood of each draw, (m,), for `best`.

    Raises:
        InputError: fewer than two draws, or shapes that do not fit.
    """
    draws = np.asarray(draws, dtype=np.float64)
    if draws.ndim != 2 or len(draws) < 2:
        raise InputError(f'moments need draws (m, p) with m >= 2, got shape {draws.shape}')
    if log_density is not None and np.shape(log_density) != (len(draws),):
        raise InputError(f'{len(draws)} draws but log_density of shape {np.shape(log_density)}')
    # Parameters as rows: sums then run along memory.
    columns = np.ascontiguousarray(draws.T)
    mean = columns.mean(axis=1)
    centred = columns - mean[:, np.newaxis]
    square = centred * centred
    variance = square.mean(axis=1)
    third = (square * centred).mean(axis=1)
    stddev = np.sqrt(variance)
    prior = (np.asarray(upper, np.float64) - np.asarray(lower, np.float64)) / np.sqrt(12.0)
    with np.errstate(divide='ignore', invalid='ignore'):
        skewness = np.where(variance > 0.0, third / stddev**3, 0.0)
        cov = stddev / np.abs(mean)
    return Moments(
        mean=mean,
        stddev=stddev,
        skewness=skewness,
        cov=cov,
        prior_dominated=_dominated(centred, variance, stddev > PRIOR_DOMINATED * prior),
        best=None if log_density is None else draws[int(np.argmax(log_density))],
    )


def _dominated(centred: Array, variance: Array, wide: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which parameters are as wide as their prior, or move with one that is.

    Args:
        centred: draws less their means, (p, m).
        variance: of each, (p,).
        wide: which are about as wide as their prior, (p,).
    """
    if not wide.any() or wide.all():
        return wide
    scale = np.sqrt(np.where(variance > 0.0, variance, 1.0))
    unit = centred / scale[:, np.newaxis]
    # One by one: the data may well determine a combination of two of them, their ratio.
    share = ((unit[wide] @ unit[~wide].T / unit.shape[1]) ** 2).max(axis=0)
    found = wide.copy()
    found[~wide] = share > _BORNE
    return found
