"""Total predictive band: uncertainty of the parameters plus a model of the residual.

The GLUE band holds the parameters' spread alone; nothing makes it cover measurements. The total
band adds what the model leaves over - an autoregressive residual of order one with the
uncertainty of its own standard deviation - and is meant to cover new measurements with its level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from actuator_glue.errors import InputError
from actuator_glue.inference.bands import Band, band, check_draws, check_levels
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Rows of the predictive ensemble: the 2.5 % quantile then lies between order statistics 25 and
# 26, and its Monte-Carlo error moves the coverage of one sample by 0.5 %, of many by nothing.
ENSEMBLE = 1000
COLUMNS_AT_ONCE = 4096


@dataclass(frozen=True, slots=True)
class ResidualModel:
    """First-order autoregressive residual e_t = mean + phi (e_(t-1) - mean) + white noise.

    Attributes:
        mean: constant part [m]; Eq. (4) removes it from the error, so a prediction adds it.
        sd: marginal standard deviation [m] (not the innovation's).
        phi: correlation of neighbouring samples, in (-1, 1).
        samples: number of residual samples it was estimated from.
    """

    mean: float
    sd: float
    phi: float
    samples: int

    @property
    def freedom(self) -> float:
        """Effective degrees of freedom of sd: n (1 - phi^2)/(1 + phi^2) - 1, at least 1."""
        squared = self.phi**2
        return max(1.0, self.samples * (1.0 - squared) / (1.0 + squared) - 1.0)

    @property
    def mean_sd(self) -> float:
        """Standard error of mean: sd over the root of n (1 - phi)/(1 + phi) [m]."""
        return self.sd / float(
            np.sqrt(max(1.0, self.samples * (1.0 - self.phi) / (1.0 + self.phi)))
        )

    def levels(self, rng: np.random.Generator, size: int) -> tuple[Array, Array]:
        """Draw mean and sd from their posterior, each of shape (size,) [m].

        sd^2 is scaled-inverse chi-square (Jeffreys prior), mean is normal given sd.
        """
        scale = np.sqrt(self.freedom / rng.chisquare(self.freedom, size))
        mean = self.mean + self.mean_sd * scale * rng.standard_normal(size)
        return mean, self.sd * scale


def fit_residual(residual: Array | Sequence[Array], *, parameters: int = 0) -> ResidualModel:
    """Estimate the residual model from residuals measured - simulated.

    phi is the lag-one autocorrelation (Yule-Walker) pooled over records.

    Args:
        residual: one residual (n,) or one per record [m].
        parameters: number of calibrated parameters, taken off the degrees of freedom of sd.

    Raises:
        InputError: fewer than eight samples more than parameters, or values not finite.
    """
    parts = [np.asarray(r, dtype=np.float64) for r in _as_list(residual)]
    count = sum(len(r) for r in parts)
    if count < parameters + 8:
        raise InputError(f'{count} residual samples are too few for a residual model')
    mean = sum(float(r.sum()) for r in parts) / count
    power = lagged = 0.0
    for part in parts:
        squares, products = _second_moments(np.ascontiguousarray(part), mean)
        power += squares
        lagged += products
    if not np.isfinite(power):
        raise InputError('the residual has NaN or infinite samples')
    phi = float(np.clip(lagged / power, -0.9999, 0.9999)) if power > 0 else 0.0
    sd = float(np.sqrt(power / (count - parameters - 1)))
    return ResidualModel(mean=mean, sd=sd, phi=phi, samples=count - parameters)


@njit
def _second_moments(residual: Array, mean: float) -> tuple[float, float]:
    """Return the sums of squares and of products of neighbours, about the mean."""
    if len(residual) == 0:
        return 0.0, 0.0
    first = residual[0] - mean
    squares, products = first * first, 0.0
    for i in range(1, len(residual)):
        here = residual[i] - mean
        squares += here * here
        products += here * (residual[i - 1] - mean)
    return squares, products


def predictive_draws(rng: np.random.Generator, draws: Array, residual: ResidualModel) -> Array:
    """Return simulated measurements, shape (m, n) [m]: each draw plus a residual path of its own.

    Rows are whole paths with the residual's correlation in time.

    Raises:
        InputError: see `bands.check_draws`.
    """
    draws = check_draws(draws)
    rows = _rows(rng, len(draws), len(draws))
    mean, sd = residual.levels(rng, len(rows))
    innovation = rng.standard_normal((len(rows), draws.shape[1]))
    innovation[:, 1:] *= np.sqrt(1.0 - residual.phi**2)
    path = scipy.signal.lfilter([1.0], [1.0, -residual.phi], innovation, axis=1)
    return np.asarray(draws[rows] + mean[:, None] + sd[:, None] * path)


def total_band(
    rng: np.random.Generator,
    draws: Array,
    residual: ResidualModel,
    levels: Sequence[float] | Array = (0.95,),
) -> Band:
    """Return the total predictive band of draws (m, n), sample by sample.

    Parameters and residual are independent; a point of the band needs the residual's marginal
    distribution only, so its correlation in time enters through the uncertainty of its level.

    Args:
        rng: random generator.
        draws: simulated responses of posterior draws, shape (m, n) [m].
        residual: residual model of the calibration record(s).
        levels: nominal coverages.

    Raises:
        InputError: see `bands.check_draws`, `bands.check_levels`.
    """
    draws = check_draws(draws)
    levels = check_levels(levels)
    rows = _rows(rng, len(draws), max(ENSEMBLE, len(draws)))
    mean, sd = residual.levels(rng, len(rows))
    parts = []
    for start in range(0, draws.shape[1], COLUMNS_AT_ONCE):
        columns = draws[:, start : start + COLUMNS_AT_ONCE]
        noise = rng.standard_normal((len(rows), columns.shape[1]))
        parts.append(band(columns[rows] + mean[:, None] + sd[:, None] * noise, levels))
    return Band(
        levels,
        np.concatenate([p.lower for p in parts], axis=1),
        np.concatenate([p.median for p in parts]),
        np.concatenate([p.upper for p in parts], axis=1),
    )


def _rows(rng: np.random.Generator, count: int, size: int) -> np.ndarray:
    # Systematic resampling: every row comes floor or ceil of its expected number of times.
    places = (rng.random() + np.arange(size)) / size
    return np.minimum(np.searchsorted(np.cumsum(np.full(count, 1.0 / count)), places), count - 1)


def _as_list(residual: Array | Sequence[Array]) -> list[Array]:
    if isinstance(residual, np.ndarray) and residual.ndim == 1:
        return [residual]
    return list(residual)
