"""What was known of Eq. (2)'s parameters before the records, as a calibration tells it."""

from __future__ import annotations

import numpy as np

from actuator_glue.inference.carried import Carried
from actuator_glue.inference.informative_prior import informative_prior
from actuator_glue.inference.mixture_density import covariance
from actuator_glue.inference.prior_conflict import Conflict, conflict
from actuator_glue.model.parameters import NAMES
from actuator_glue.records import Array


class BasePrior:
    """The mixture of a calibration in the logarithms of the parameters of Eq. (2) that it knows.

    A posterior is drawn with the mixture itself; a fit takes the normal of its moments.

    Args:
        carried: draws of the calibration, drifted to the time of the records.
        upper: upper bounds of Eq. (2)'s parameters, (4,).

    Attributes:
        components: normal components of the mixture.
        quality: energy coefficient between the draws and the mixture, 0 for equal.

    Raises:
        InputError: it knows none of the four parameters.
    """

    def __init__(self, carried: Carried, upper: Array) -> None:
        zero = (0.0,) * len(NAMES)
        self._known = informative_prior(carried, NAMES, zero, tuple(map(float, upper)), None)
        self._columns = list(self._known.columns)
        mean, spread = covariance(self._known.mixture)
        self._mean = mean + np.log(upper[self._columns])
        self._whiten = np.linalg.inv(np.linalg.cholesky(spread))
        self.components = len(self._known.mixture.log_weights)
        self.quality = self._known.quality()

    def start(self, theta: Array) -> Array:
        """Return parameters (4,) with its middle for those that it knows, physical units."""
        out = np.array(theta, np.float64)
        out[self._columns] = np.exp(self._mean)
        return out

    def slopes(self, count: int) -> Array:
        """Derivatives of `pull` to the working coordinates of a model of p parameters, (p, q)."""
        out = np.zeros((count, len(self._columns)))
        out[self._columns] = self._whiten.T
        return out

    def pull(self, z: Array) -> Array:
        """Distance of working coordinates (..., p) from its middle in standard units, (..., q)."""
        return np.asarray((z[..., self._columns] - self._mean) @ self._whiten.T)

    def log_density(self, theta: Array) -> Array:
        """Log density (m,) at physical parameters (m, p), per volume of the logarithms."""
        base = np.ascontiguousarray(theta[:, : len(NAMES)])
        logs = np.log(base[:, self._columns]).sum(axis=1)
        return np.asarray(self._known.log_density(base) + logs)

    def conflict(self, draws: Array) -> Conflict:
        """How far the records contradict it, from draws (m, p) of the posterior with it."""
        return conflict(self._known, draws[:, : len(NAMES)])
