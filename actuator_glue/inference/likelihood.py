"""Log likelihoods of simulation errors: GLUE's informal one and two formal ones.

All are callables (m, p) -> (m,) as the sampler wants them. Constants that do not depend on
theta are left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.inference.compiled import Compiled, likelihoods
from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.model.fast import FastErrors
from actuator_glue.model.force_errors import ForceErrors
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

# Lag-one autocorrelation of the errors, estimated with the model's parameters by Ar1Likelihood.
PHI = Parameter('phi', '1', 0.0, 1.0, 'lag-one autocorrelation of the errors')


class Errors(Protocol):
    """Error sums of a model over R records (model.exact.ExactErrors and its kin)."""

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Counted samples of every record, (R,)."""
        ...

    def __call__(self, theta: Array, /) -> Array:
        """Return (sum e, sum e^2) of every theta (m, p) and record, (m, R, 2) [m, m^2]."""
        ...


class RawErrors(Protocol):
    """Errors sample by sample, for likelihoods that need their order."""

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Counted samples of every record, (R,)."""
        ...

    def residuals(self, theta: Array, /) -> Sequence[Array]:
        """Return the counted errors e [m] of every record, each (m, n_r), for theta (m, p)."""
        ...


def _compiled(errors: Errors, size: float, shaping: float, sigma: float) -> Compiled | None:
    if not isinstance(errors, FastErrors):
        return None
    return Compiled(errors.rows, errors.samples, errors.tolerance, size, shaping, sigma)


class GlueLikelihood:
    """Eq. (4): L = -G ln Var[E(theta)], E the errors of all records one after another [m].

    The mean is removed over all records together; Var divides by the number of samples. With E in
    mm instead, as in the paper, L is larger by G ln 1e-6: it shapes nothing.

    Args:
        errors: error sums of the model.
        shaping_factor: G > 0.

    Raises:
        InputError: the shaping factor is not a positive number.
    """

    def __init__(self, errors: Errors, shaping_factor: float = 256.0) -> None:
        if not (math.isfinite(shaping_factor) and shaping_factor > 0.0):
            raise InputError(f'shaping factor G must be positive, got {shaping_factor:g}')
        self.errors = errors
        self.shaping_factor = float(shaping_factor)
        self._size = float(np.sum(errors.sizes))

    def __call__(self, theta: Array) -> Array:
        """Return L (m,) of theta (m, p)."""
        values: Array = likelihoods(self.errors(theta), self._size, self.shaping_factor, 0.0)
        return values

    def compiled(self) -> Compiled | None:
        """Return the same as plain arrays; None where the errors are not `FastErrors`."""
        return _compiled(self.errors, self._size, self.shaping_factor, 0.0)


class GaussianLikelihood:
    """Independent Gaussian errors of zero mean: -(sum e^2)/(2 sigma^2), or sigma integrated out.

    Without sigma, Jeffreys' prior 1/sigma is integrated out: -(n/2) ln sum e^2, which is Eq. (4)
    with G = n/2 but for the mean (Box and Tiao 1973).

    Args:
        errors: error sums of the model.
        sigma: standard deviation of the errors [m], or None to integrate it out.

    Raises:
        InputError: sigma is not a positive number.
    """

    def __init__(self, errors: Errors, sigma: float | None = None) -> None:
        if sigma is not None and not (math.isfinite(sigma) and sigma > 0.0):
            raise InputError(f'error standard deviation must be positive, got {sigma:g} m')
        self.errors = errors
        self.sigma = sigma
        self._size = float(np.sum(errors.sizes))

    def __call__(self, theta: Array) -> Array:
        """Return the log likelihood (m,) of theta (m, p)."""
        values: Array = likelihoods(self.errors(theta), self._size, 0.0, self.sigma or 0.0)
        return values

    def compiled(self) -> Compiled | None:
        """Return the same as plain arrays; None where the errors are not `FastErrors`."""
        return _compiled(self.errors, self._size, 0.0, self.sigma or 0.0)


class ForceLikelihood:
    """A log likelihood of displacements with that of the forces: less G ln sum e^2 of the force.

    With G half of the samples it is the Gaussian one of independent errors whose standard
    deviation is integrated out, beside transducers whose gain and offset are each record's own.

    Args:
        displacement: log likelihood of the displacements.
        errors: of the forces.
        shaping_factor: G > 0 of the forces.

    Raises:
        InputError: the shaping factor is not a positive number.
    """

    def __init__(
        self, displacement: LogDensity, errors: ForceErrors, shaping_factor: float
    ) -> None:
        if not (math.isfinite(shaping_factor) and shaping_factor > 0.0):
            raise InputError(f'shaping factor G must be positive, got {shaping_factor:g}')
        self.displacement = displacement
        self.errors = errors
        self.shaping_factor = shaping_factor

    def __call__(self, theta: Array) -> Array:
        """Return the log likelihood (m,) of theta (m, p)."""
        with np.errstate(divide='ignore', invalid='ignore'):
            force = np.log(self.errors(theta).sum(axis=1))
        return np.asarray(self.displacement(theta) - self.shaping_factor * force)


class Ar1Likelihood:
    """Gaussian errors with lag-one autocorrelation phi, their variance integrated out.

    Every record starts from the stationary distribution: S = sum_r [(1 - phi^2) e_0^2 +
    sum_t (e_t - phi e_(t-1))^2], L = -(n/2) ln S + (R/2) ln(1 - phi^2) (Box, Jenkins and Reinsel
    2008, appendix A7.4, with Jeffreys' prior of the innovation variance).

    Args:
        errors: errors sample by sample.
        phi: the autocorrelation; None: it is the last column of theta (bounds in `PHI`).

    Raises:
        InputError: phi is not inside (-1, 1).
    """

    def __init__(self, errors: RawErrors, phi: float | None = None) -> None:
        if phi is not None and not -1.0 < phi < 1.0:
            raise InputError(f'autocorrelation phi must lie inside (-1, 1), got {phi:g}')
        self.errors = errors
        self.phi = phi
        self._size = float(np.sum(errors.sizes))

    def __call__(self, theta: Array) -> Array:
        """Return the log likelihood (m,) of theta (m, p), or (m, p + 1) where phi is estimated."""
        if self.phi is None:
            phi = theta[:, -1]
            theta = np.ascontiguousarray(theta[:, :-1])
        else:
            phi = np.full(len(theta), self.phi)
        total = np.zeros(len(theta))
        count = 0
        for e in self.errors.residuals(theta):
            first, last = e[:, 0] ** 2, e[:, -1] ** 2
            square = (e * e).sum(axis=1)
            lagged = (e[:, 1:] * e[:, :-1]).sum(axis=1)
            total += square - 2.0 * phi * lagged + phi**2 * (square - first - last)
            count += 1
        with np.errstate(divide='ignore', invalid='ignore'):
            return np.asarray(
                -0.5 * self._size * np.log(total) + 0.5 * count * np.log1p(-(phi**2))
            )
