"""Log likelihoods as plain arrays, so that compiled loops need no Python between generations."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from actuator_glue.inference.evaluate import LogDensity
from actuator_glue.jit import njit
from actuator_glue.model import kernel, laguerre, quadratic, ridge
from actuator_glue.model.fast import Samples
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
        mapped: points are coordinates of `model.ridge` and the log Jacobian is added.
        stiffness: specimen stiffness [N/m] of those coordinates.
        low: lower bounds of the physical parameters, (p,).
        high: upper bounds, (p,).
    """

    rows: Array
    samples: Samples
    tolerance: float
    size: float
    shaping: float
    sigma: float
    mapped: bool = False
    stiffness: float = 0.0
    low: Array = np.empty(0)
    high: Array = np.empty(0)


@runtime_checkable
class Compilable(Protocol):
    """A log density that may have a compiled form."""

    def compiled(self) -> Compiled | None:
        """Return it, None where there is none."""
        ...


def compiled(log_density: LogDensity) -> Compiled | None:
    """Return the compiled form of a log density, None where it has none."""
    return log_density.compiled() if isinstance(log_density, Compilable) else None


# Strict floating point in what follows: inlined elsewhere, it could be reassociated or fused with
# what comes next, which would be other bits.
@njit(fastmath=False)
def variance_likelihood(sums, size, shaping):  # type: ignore[no-untyped-def]
    """-shaping ln Var of errors given their sums (m, R, 2) over `size` samples in all."""
    values = np.empty(sums.shape[0])
    for i in range(sums.shape[0]):
        mean = 0.0
        square = 0.0
        for r in range(sums.shape[1]):
            mean += sums[i, r, 0]
            square += sums[i, r, 1]
        mean /= size
        values[i] = -shaping * math.log(square / size - mean * mean)
    return values


@njit(fastmath=False)
def gaussian_likelihood(sums, size, sigma):  # type: ignore[no-untyped-def]
    """Gaussian log likelihood given error sums (m, R, 2); sigma = 0 integrates it out."""
    values = np.empty(sums.shape[0])
    for i in range(sums.shape[0]):
        square = 0.0
        for r in range(sums.shape[1]):
            square += sums[i, r, 1]
        if sigma > 0.0:
            values[i] = -0.5 * square / (sigma * sigma)
        else:
            values[i] = -0.5 * size * math.log(square)
    return values


@njit(fastmath=False)
def _exactly(rows, samples, theta, exact, sums):  # type: ignore[no-untyped-def]
    """Overwrite the error sums (m, R, 2) of thetas (m, p) where exact (R, m) asks for it."""
    for r in range(len(rows)):
        which = np.flatnonzero(exact[r])
        if which.size == 0:
            continue
        systems = kernel.systems(theta[which], rows[r, laguerre.STIFFNESS])
        foh = rows[r, laguerre.FOH] > 0.0
        table = kernel.discretise(systems, rows[r, laguerre.PERIOD], foh)
        begin, end = samples.first[r], samples.first[r + 1]
        out = np.empty((len(which), 2))
        kernel.error_sums(
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


@njit(fastmath=False)
def log_densities(density, x, log_jacobian, values):  # type: ignore[no-untyped-def]
    """Fill values (m,) with the log densities of points x (m, p).

    Points beyond the bounds (log_jacobian minus infinity) are left out: they are impossible.
    """
    theta = np.empty_like(x)
    which = np.empty(len(x), np.int64)
    inner = np.zeros(len(x))
    count = 0
    for i in range(len(x)):
        values[i] = -np.inf
        if log_jacobian[i] == -np.inf:
            continue
        if density.mapped:
            inner[i] = ridge.physical(
                x[i], density.stiffness, density.low, density.high, theta[count]
            )
            if inner[i] == -np.inf:
                continue
        else:
            theta[count] = x[i]
        which[count] = i
        count += 1
    records = len(density.rows)
    sums = np.empty((count, records, 2))
    exact = np.empty((records, count), np.bool_)
    if quadratic.evaluate_all(density.rows, theta[:count], density.tolerance, sums, exact):
        _exactly(density.rows, density.samples, theta[:count], exact, sums)
    if density.shaping > 0.0:
        found = variance_likelihood(sums, density.size, density.shaping)
    else:
        found = gaussian_likelihood(sums, density.size, density.sigma)
    for i in range(count):
        values[which[i]] = inner[which[i]] + found[i] if density.mapped else found[i]
