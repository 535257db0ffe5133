"""Mean and covariance of a nearly normal density from its values at draws, not from their scatter.

Moments of draws scatter: of 400 independent ones the mean by a twentieth of a standard deviation,
the variance by 7 %. Handed from window to window that adds up, in directions that no window tells.
The logarithm of a normal density is a quadratic function, which a regression on few draws gives
exactly, and of one that is nearly normal nearly so.
"""

from __future__ import annotations

import numpy as np

from actuator_glue.records import Array

# Share of the variance of the log density that a quadratic function has to explain.
_EXPLAINED = 0.9
# Draws per coefficient of that function.
_ENOUGH = 5
# Beyond these it is no correction of scatter: ratio of variances, standard deviations of a mean.
_RATIO, _SHIFT = 2.0, 0.5


def refined(draws: Array, at: Array, log_density: Array) -> Array:
    """Return draws (m, p) stretched and moved to the normal that a log density tells.

    They are returned as they are where it is not nearly normal, or `at` are too few.

    Args:
        draws: coordinates of some draws (m, p).
        at: coordinates of draws of the same density (n, p), whose log density is known.
        log_density: at these (n,) [nats], of the coordinates, up to a constant.
    """
    found = _normal(at, log_density)
    spread = np.cov(draws.T, bias=True).reshape(draws.shape[1], -1)
    if found is None or np.linalg.matrix_rank(spread) < len(spread):
        return draws
    mean, covariance = found
    unit = np.linalg.solve(np.linalg.cholesky(spread), (draws - draws.mean(axis=0)).T)
    return np.asarray(mean + (np.linalg.cholesky(covariance) @ unit).T)


def _normal(at: Array, log_density: Array) -> tuple[Array, Array] | None:
    """Return mean (p,) and covariance (p, p); None where the density is no such normal."""
    count = at.shape[1]
    row, column = np.triu_indices(count)
    spread = np.cov(at.T, bias=True).reshape(count, -1)
    few = len(at) < _ENOUGH * (1 + count + len(row))
    if few or not np.isfinite(log_density).all() or np.linalg.matrix_rank(spread) < count:
        return None
    middle, scale = at.mean(axis=0), np.linalg.cholesky(spread)
    y = np.linalg.solve(scale, (at - middle).T).T
    features = np.hstack([np.ones((len(y), 1)), y, y[:, row] * y[:, column]])
    logs = log_density - log_density.mean()
    found = np.linalg.solve(features.T @ features, features.T @ logs)
    unexplained = float(np.var(logs - features @ found))
    if unexplained > (1.0 - _EXPLAINED) * float(np.var(logs)):
        return None
    precision = np.zeros((count, count))
    precision[row, column] = -found[1 + count :]
    precision += precision.T
    values = np.linalg.eigvalsh(precision)
    if not 1.0 / _RATIO < values[0] <= values[-1] < _RATIO:
        return None
    shift = np.linalg.solve(precision, found[1 : 1 + count])
    if np.abs(shift).max() > _SHIFT:
        return None
    return middle + scale @ shift, scale @ np.linalg.inv(precision) @ scale.T
