"""Log likelihoods as plain arrays, so that compiled loops need no Python between steps."""

from __future__ import annotations

import math
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.inference.mixture_density import NO_MIXTURE, Mixture, log_mixture
from actuator_glue.jit import njit
from actuator_glue.model import identifiable, kernel, kernel_lanes
from actuator_glue.model.fast import laguerre, quadratic
from actuator_glue.model.fast.errors import JoinedSamples
from actuator_glue.records import Array


class Compiled(NamedTuple):
    """A log likelihood of `FastErrors`, perhaps of mapped parameters.

    Attributes:
        rows: its quadratic forms, one row per record (`FastErrors.rows`).
        samples: the records' samples, for the exact kernel.
        tolerance: error bound beyond which the exact kernel is needed.
        size: samples counted in all records.
        shaping: G of Eq. (4), or 0 for independent Gaussian errors.
        sigma: their standard deviation [m], or 0 where it is integrated out.
        mapped: points are coordinates of `model.identifiable` and the log Jacobian is added.
        stiffness: specimen stiffness [N/m] of those coordinates.
        low: lower bounds of the physical parameters, (p,).
        high: upper bounds, (p,).
        prior: density of mapped coordinates in place of the uniform prior's; without a component
            there is none.
    """

    rows: Array
    samples: JoinedSamples
    tolerance: float
    size: float
    shaping: float
    sigma: float
    mapped: bool = False
    stiffness: float = 0.0
    low: Array = np.empty(0)
    high: Array = np.empty(0)
    prior: Mixture = NO_MIXTURE


def compiled(log_density: LogDensity) -> Compiled | None:
    """Return the compiled form of a log density: what its method of this name says, if any."""
    form = getattr(log_density, 'compiled', None)
    return None if form is None else cast(Compiled | None, form())


# Strict floating point in what follows: inlined elsewhere, it could be reassociated or fused with
# what comes next, which would be other bits.
@njit(fastmath=False)
def _likelihood(total: float, square: float, size: float, shaping: float, sigma: float) -> float:
    """Log likelihood of errors given their sum and sum of squares over `size` samples in all.

    -shaping ln Var; for shaping = 0 the Gaussian one, whose sigma = 0 is integrated out.
    """
    if shaping > 0.0:
        mean = total / size
        return -shaping * math.log(square / size - mean * mean)
    if sigma > 0.0:
        return -0.5 * square / (sigma * sigma)
    return -0.5 * size * math.log(square)


@njit(fastmath=False)
def likelihood(sums: Array, size: float, shaping: float, sigma: float) -> float:
    """Return the log likelihood of the error sums (R, 2) of all records."""
    total = 0.0
    square = 0.0
    for r in range(len(sums)):
        total += sums[r, 0]
        square += sums[r, 1]
    return _likelihood(total, square, size, shaping, sigma)


@njit(fastmath=False)
def likelihoods(sums: Array, size: float, shaping: float, sigma: float) -> Array:
    """Return the log likelihoods (m,) of error sums (m, R, 2)."""
    values = np.empty(len(sums))
    for i in range(len(sums)):
        values[i] = likelihood(sums[i], size, shaping, sigma)
    return values


@njit(fastmath=False)
def _exactly(rows: Array, samples: JoinedSamples, theta: Array, slack: Array, sums: Array) -> None:
    """Overwrite the error sums (m, R, 2) of thetas (m, p) where slack (R, m) is not 0."""
    for r in range(len(rows)):
        which = np.flatnonzero(slack[r])
        if which.size == 0:
            continue
        systems = kernel.systems(theta[which], rows[r, laguerre.STIFFNESS])
        foh = rows[r, laguerre.FOH] > 0.0
        table = kernel.discretise(systems, rows[r, laguerre.PERIOD], foh)
        begin, end = samples.first[r], samples.first[r + 1]
        out = np.empty((len(which), 2))
        kernel_lanes.error_sums(
            table,
            samples.starts[r],
            samples.measured[begin:end],
            samples.command[begin + 2 * r : end + 2 * r + 2],
            samples.settle[r],
            foh,
            out,
        )
        for i in range(len(which)):
            sums[which[i], r] = out[i]


class DensityScratch(NamedTuple):
    """What `log_densities` of m points writes to, so that a loop allocates nothing.

    Attributes:
        theta: physical parameters of the points inside the bounds, (m, 4).
        which: their places, (m,).
        inner: log Jacobians of mapped points, or their log prior density, (m,).
        sums: error sums, (m, R, 2).
        slack: how far the sums may be wrong, (R, m) [m^2]; 0 for not worth mentioning.
    """

    theta: Array
    which: NDArray[np.int64]
    inner: Array
    sums: Array
    slack: Array


@njit
def scratch(records: int, count: int) -> DensityScratch:
    """Return room for so many points' errors over so many records."""
    return DensityScratch(
        np.empty((count, 4)),
        np.empty(count, np.int64),
        np.zeros(count),
        np.empty((count, records, 2)),
        np.empty((records, count)),
    )


# Log likelihood by which a point must be hopeless: rounding must not decide.
_SURE = 1e-6


@njit(fastmath=False)
def _hopeless(density: Compiled, sums: Array, slack: Array, floor: float) -> bool:
    """Whether even the least error that the bound allows leaves a log likelihood below `floor`.

    sums (R, 2) and slack (R,) are those of one point.
    """
    least = 0.0
    for r in range(len(sums)):
        count = density.rows[r, laguerre.COUNT]
        least += max(sums[r, 1] - sums[r, 0] * sums[r, 0] / count - slack[r], 0.0)
    if not least > 0.0:
        return False
    best = _likelihood(0.0, least, density.size, density.shaping, density.sigma)
    return best < floor - _SURE


@njit(fastmath=False)
def log_densities(
    density: Compiled,
    x: Array,
    log_jacobian: Array,
    floor: Array,
    values: Array,
    scratch: DensityScratch,
) -> None:
    """Fill values (m,) with the log densities of points x (m, p).

    Points beyond the bounds (log_jacobian minus infinity) are left out: they are impossible. And
    so are those that would need the exact kernel, but are below `floor` (m,) whatever it says.
    """
    theta, inner = scratch.theta, scratch.inner
    count = 0
    for i in range(len(x)):
        values[i] = -np.inf
        if log_jacobian[i] == -np.inf:
            continue
        if density.mapped:
            inner[count] = identifiable.physical(
                x[i], density.stiffness, density.low, density.high, theta[count]
            )
            if inner[count] == -np.inf:
                continue
            if len(density.prior.log_weights):
                inner[count] = log_mixture(density.prior, x[i])
        else:
            for j in range(x.shape[1]):
                theta[count, j] = x[i, j]
        scratch.which[count] = i
        count += 1
    theta, sums, slack = theta[:count], scratch.sums[:count], scratch.slack[:, :count]
    if quadratic.evaluate_all(density.rows, theta, density.tolerance, sums, slack):
        for i in range(count):
            least = floor[scratch.which[i]] - (inner[i] if density.mapped else 0.0)
            if (slack[:, i] != 0.0).any() and _hopeless(density, sums[i], slack[:, i], least):
                scratch.which[i] = -1
                slack[:, i] = 0.0
        _exactly(density.rows, density.samples, theta, slack, sums)
    for i in range(count):
        if scratch.which[i] < 0:
            continue
        found = likelihood(sums[i], density.size, density.shaping, density.sigma)
        values[scratch.which[i]] = inner[i] + found if density.mapped else found
