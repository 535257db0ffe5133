"""Deterministic identification: transfer functions and the joint fit of Eq. (2)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import t as student

from studies.chen.library import (
    STIFFNESS,
    TABLE_2,
    Array,
    ExactErrors,
    InputError,
    Record,
    bounds,
    linear,
)


def least(
    error: Callable[[Array], Array], scale: Array, lower: Array, upper: Array
) -> tuple[Array, Array, Array]:
    """Minimise a sum of squares within bounds.

    Args:
        error: simulation error (n,) [m] of theta (p,).
        scale: starting point and typical size of each parameter, shape (p,), not zero.
        lower: lower bounds, shape (p,).
        upper: upper bounds, shape (p,).

    Returns:
        theta (p,), Jacobian (n, p) and error (n,) at the minimum.
    """

    def in_mm(relative: Array) -> Array:
        return 1e3 * error(relative * scale)

    solution = least_squares(
        in_mm,
        np.ones(len(scale)),
        jac='3-point',
        bounds=(lower / scale, upper / scale),
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    theta = np.clip(solution.x * scale, lower, upper)
    return theta, 1e-3 * np.asarray(solution.jac) / scale, 1e-3 * np.asarray(solution.fun)


def covariance(jacobian: Array, error: Array, scale: Array) -> Array:
    """Return the covariance (p, p) of a fit with white residuals; scale (p,) conditions it."""
    slopes = jacobian * scale
    variance = float(error @ error) / (len(error) - len(scale))
    return np.asarray(np.linalg.inv(slopes.T @ slopes) * variance * np.outer(scale, scale))


@dataclass(frozen=True, slots=True, eq=False)
class TransferFunction:
    """Fit of x/u = b_0 / (s^2 + a_1 s + a_0), which MATLAB's `tfest` gives as Eqs. (3a), (3b).

    Attributes:
        value: a_1 [1/s], a_0 [1/s^2], b_0 [1/s^2], shape (3,).
        covariance: of the estimate for white residuals, shape (3, 3).
        rms: root mean square of the simulation error [m].
        samples: number of samples fitted.
    """

    value: Array
    covariance: Array
    rms: float
    samples: int

    @property
    def stddev(self) -> Array:
        """Standard errors, shape (3,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def static_gain(self) -> float:
        """b_0 / a_0."""
        return float(self.value[2] / self.value[1])

    @property
    def static_gain_stddev(self) -> float:
        """Standard error of the static gain (first order)."""
        _, a0, b0 = self.value
        slope = np.array([0.0, -b0 / a0**2, 1.0 / a0])
        return float(np.sqrt(slope @ self.covariance @ slope))

    def reach(self, level: float = 0.95) -> float:
        """Return how many standard errors the confidence limits lie to each side."""
        return float(student.ppf(0.5 * (1.0 + level), self.samples - 3))


def fit_transfer_function(record: Record) -> TransferFunction:
    """Fit a second-order transfer function without zeros to a record by its simulation error.

    Starts from the best of a grid of natural frequencies and damping ratios (gain by linear
    regression); positive coefficients keep the fit stable. Confidence limits hold where the
    residual is white.

    Args:
        record: command and measured displacement from rest, at least 50 samples.

    Raises:
        InputError: too few samples, or nothing moves.
    """
    n = len(record)
    if n < 50:
        raise InputError(f'{record.source}: {n} samples are too few for a transfer function')
    if not np.ptp(record.command) > 0 or not np.ptp(record.measured) > 0:
        raise InputError(f'{record.source}: command or measured displacement never moves')

    def simulate(systems: Array) -> Array:
        return linear.respond(systems, record.command, period=record.period, hold=record.hold)

    def error(system: Array) -> Array:
        return np.asarray(simulate(system[None])[0] - record.measured)

    start = _grid_start(record, simulate)
    value, jacobian, misfit = least(error, start, 1e-3 * start, 1e3 * start)
    rms = float(np.sqrt(np.mean(misfit**2)))
    return TransferFunction(value, covariance(jacobian, misfit, start), rms, n)


def _grid_start(record: Record, simulate: Callable[[Array], Array]) -> Array:
    nyquist = np.pi * record.rate
    natural = np.geomspace(max(0.5, nyquist / 2000), nyquist / 2, 24)
    w, z = (g.ravel() for g in np.meshgrid(natural, [0.3, 0.7, 1.0, 1.5]))
    systems = np.stack([2 * z * w, w**2, w**2], axis=1)
    shapes = simulate(systems)  # of unit static gain
    gain = shapes @ record.measured / np.sum(shapes**2, axis=1)
    miss = np.sum((record.measured - gain[:, None] * shapes) ** 2, axis=1)
    miss[~(gain > 0)] = np.inf
    if not np.isfinite(miss).any():
        raise InputError(f'{record.source}: the measured displacement opposes the command')
    best = int(np.argmin(miss))
    return np.asarray(systems[best] * np.array([1.0, 1.0, gain[best]]))


@dataclass(frozen=True, slots=True, eq=False)
class PhysicalFit:
    """Parameters of Eq. (2) that fit both tests best by Eq. (4), and standard errors.

    Attributes:
        theta: beta_1, alpha_1_beta_0, alpha_2, alpha_3, shape (4,).
        stddev: standard errors for white residuals, shape (4,); NaN for one on its bound.
        at_bound: which parameters sit on a bound of Table 3, shape (4,) bool.
        rms: rms simulation error of each test [m].
        table_2_rms: the same with Table 2's parameters [m].
    """

    theta: Array
    stddev: Array
    at_bound: NDArray[np.bool_]
    rms: Array
    table_2_rms: Array


def fit_physical(records: Sequence[Record]) -> PhysicalFit:
    """Fit Eq. (2) to records jointly: least squares of the error less its mean, within Table 3.

    Args:
        records: tests with known specimen stiffness, at least one of them with k > 0.

    Raises:
        InputError: a record's specimen stiffness is not known.
    """
    errors = ExactErrors(records)
    lower, upper = bounds()

    def error(theta: Array) -> Array:
        parts = np.concatenate([r[0] for r in errors.residuals(theta[None])])
        return np.asarray(parts - parts.mean())

    def rms(theta: Array) -> Array:
        return np.asarray(np.sqrt(errors(theta)[:, 1] / errors.sizes))

    theta, jacobian, misfit = least(error, TABLE_2, lower, upper)
    # On a bound within what a posterior could see: a millionth of the prior's width.
    at_bound = np.minimum(theta - lower, upper - theta) < 1e-6 * (upper - lower)
    theta = np.where(at_bound & (theta - lower < upper - theta), lower, theta)
    stddev, free = np.full(4, np.nan), ~at_bound
    stddev[free] = np.sqrt(np.diag(covariance(jacobian[:, free], misfit, TABLE_2[free])))
    return PhysicalFit(theta, stddev, at_bound, rms(theta), rms(TABLE_2))


def implied(theta: Array) -> Array:
    """Return d_1/d_2, d_0/d_2, n_0/d_2 of Eq. (2b) for theta (4,) and each test, shape (2, 3)."""
    return np.concatenate([linear.systems(theta, stiffness) for stiffness in STIFFNESS])
