"""Conflict between a prior and data: a predictive p-value, accumulated into a sequential test."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from actuator_glue.errors import InputError
from actuator_glue.inference.informative_prior import InformativePrior
from actuator_glue.inference.mixture_density import covariance
from actuator_glue.records import Array

# Share of its prior variance below which a direction counts as told by the data: nearer to 1 the
# draws' own scatter would decide.
_TOLD = 0.9
# Evidence of one window is bounded: an absurd window weighs no more than a handful of odd ones.
_LEAST = 1e-8


@dataclass(frozen=True, slots=True)
class Conflict:
    """How far data contradict a prior.

    Attributes:
        square: squared distance of the posterior's mean from the prior's, in units of its
            prior predictive covariance; chi-square with `directions` degrees of freedom where
            the prior holds.
        directions: directions of the parameters that the data say something about.
        p_value: probability of so large a distance where the prior holds.
    """

    square: float
    directions: int
    p_value: float


def conflict(prior: InformativePrior, posterior: Array) -> Conflict:
    """Return the conflict between a prior and the posterior drawn with it, (m, p).

    The means m0, m1 and covariances S0, S1 of a normal prior and of its posterior: before the
    data are seen, m1 - m0 is normal with covariance S0 - S1, and its distance from 0 is their
    check of a prior (Evans and Moshonov 2006), exact where both are normal and the likelihood is
    that of the data. A mixture counts by its mean and covariance. With Eq. (4) the p-value is too
    large where 2 G is less than the effective number of samples, and too small where it is more
    (a residual with long correlation).
    """
    mean, spread = covariance(prior.mixture)
    z = prior.coordinates(posterior)
    whiten = np.linalg.inv(np.linalg.cholesky(spread))
    moved = whiten @ (z.mean(axis=0) - mean)
    values, vectors = np.linalg.eigh(whiten @ np.cov(z.T).reshape(spread.shape) @ whiten.T)
    told = values < _TOLD
    if not told.any():
        return Conflict(0.0, 0, 1.0)
    square = float(((vectors.T @ moved)[told] ** 2 / (1.0 - values[told])).sum())
    return Conflict(square, int(told.sum()), float(scipy.stats.chi2.sf(square, told.sum())))


class SequentialTest:
    """Test of a prior over many windows, with a bounded rate of false alarms.

    Each p-value p is an e-value 1/(2 sqrt p), whose mean is at most 1 where the prior holds; they
    are multiplied from the most favourable start on (CUSUM). With a threshold c the mean time to
    a false alarm is at least c windows (Shin, Ramdas and Rinaldo 2022), as far as the p-values are
    uniform or larger where the prior holds.

    Attributes:
        threshold: c.
        evidence: running product of the e-values, 1 at its least; no marginal likelihood.
        since: index of the window that the product began with.

    Args:
        windows: independent windows per hour, at most.
        false_alarms: false alarms per hour, at most.

    Raises:
        InputError: the rate of false alarms is not positive.
    """

    def __init__(self, windows: float, false_alarms: float) -> None:
        if not false_alarms > 0.0:
            raise InputError(f'{false_alarms:g} false alarms per hour: the rate must be positive')
        self.threshold = max(windows / false_alarms, 1.0)
        self.evidence = 1.0
        self.since = 0

    def add(self, p_value: float, index: int) -> bool:
        """Take the p-value of the window at a running index; return whether there is an alarm.

        `since` is then the index of the first window that contradicts.
        """
        if self.evidence <= 1.0:
            self.evidence, self.since = 1.0, index
        self.evidence *= 0.5 / np.sqrt(max(p_value, _LEAST))
        return self.evidence >= self.threshold

    def restart(self) -> None:
        """Begin again, after an alarm."""
        self.evidence = 1.0
