"""Output-error transfer-function fit: what MATLAB's `tfest` does for Eqs. (3a) and (3b)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from actuator_glue.errors import InputError
from actuator_glue.model import linear
from actuator_glue.records import Array, Record

NAMES = ('a_1', 'a_0', 'b_0')


@dataclass(frozen=True, slots=True, eq=False)
class TransferFunction:
    """Fit of x/u = b_0 / (s^2 + a_1 s + a_0).

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

    def limits(self, level: float = 0.95) -> Array:
        """Return confidence limits of a_1, a_0, b_0, shape (2, 3)."""
        reach = student.ppf(0.5 * (1.0 + level), self.samples - 3) * self.stddev
        return np.stack([self.value - reach, self.value + reach])


def fit_transfer_function(record: Record) -> TransferFunction:
    """Fit a second-order transfer function without zeros to a record by its simulation error.

    Starts from the best of a grid of natural frequencies and damping ratios (gain by linear
    regression), then Levenberg-Marquardt in the logarithms of the coefficients, so that the
    fitted model is stable. Confidence limits hold where the residual is white.

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

    def error(log_system: Array) -> Array:
        return np.asarray(simulate(np.exp(log_system)[None])[0] - record.measured)

    def slope(log_system: Array) -> Array:
        # Central differences in the logarithms: relative error of order step^2 = 1e-8.
        step = 1e-4 * np.eye(3)
        sides = simulate(np.exp(np.concatenate([log_system + step, log_system - step])))
        return np.asarray((sides[:3] - sides[3:]).T / 2e-4)

    start = _grid_start(record)
    solution = least_squares(
        error, np.log(start), jac=slope, method='lm', xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    value = np.exp(solution.x)
    square = 2.0 * float(solution.cost)
    jacobian = slope(solution.x) / value
    covariance = np.linalg.inv(jacobian.T @ jacobian) * square / (n - 3)
    return TransferFunction(value, covariance, float(np.sqrt(square / n)), n)


def _grid_start(record: Record) -> Array:
    nyquist = np.pi * record.rate
    natural = np.geomspace(max(0.5, nyquist / 2000), nyquist / 2, 24)
    damping = np.array([0.3, 0.7, 1.0, 1.5])
    w, z = (g.ravel() for g in np.meshgrid(natural, damping))
    systems = np.stack([2 * z * w, w**2, w**2], axis=1)
    shapes = linear.respond(
        systems, record.command, period=record.period, hold=record.hold
    )  # of unit static gain
    gain = shapes @ record.measured / np.sum(shapes**2, axis=1)
    miss = np.sum((record.measured - gain[:, None] * shapes) ** 2, axis=1)
    miss[~(gain > 0)] = np.inf
    if not np.isfinite(miss).any():
        raise InputError(f'{record.source}: the measured displacement opposes the command')
    best = int(np.argmin(miss))
    return np.asarray(systems[best] * np.array([1.0, 1.0, gain[best]]))
