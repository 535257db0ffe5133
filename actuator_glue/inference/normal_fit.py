"""Mean and covariance of a nearly normal density from its values at draws, not from their scatter.

Moments of draws scatter: of 400 independent ones the mean by a twentieth of a standard deviation,
the variance by 7 %. Handed from window to window that adds up, in directions that no window
determines. The logarithm of a normal density is a quadratic function, which a regression on few
draws gives exactly, and that of a nearly normal density nearly so.
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


def refined(draws: Array, log_density: Array) -> Array:
    """Return draws stretched and moved to the normal density that their log densities tell.

    They are returned as they are where that is not nearly normal, or they are too few.

    Args:
        draws: coordinates (m, p).
        log_density: of the coordinates at the draws (m,) [nats], up to a constant.
    """
    count = draws.shape[1]
    row, column = np.triu_indices(count)
    spread = np.cov(draws.T, bias=True).reshape(count, -1)
    few = len(draws) < _ENOUGH * (1 + count + len(row))
    if few or not np.isfinite(log_density).all() or np.linalg.matrix_rank(spread) < count:
        return draws
    middle, scale = draws.mean(axis=0), np.linalg.cholesky(spread)
    y = np.linalg.inv(scale) @ (draws - middle).T
    features = np.vstack([np.ones((1, len(draws))), y, y[row] * y[column]])
    logs = log_density - log_density.mean()
    found = np.linalg.solve(features @ features.T, features @ logs)
    unexplained = float(np.var(logs - found @ features))
    if unexplained > (1.0 - _EXPLAINED) * float(np.var(logs)):
        return draws
    precision = np.zeros((count, count))
    precision[row, column] = -found[1 + count :]
    precision += precision.T
    values = np.linalg.eigvalsh(precision)
    if not 1.0 / _RATIO < values[0] <= values[-1] < _RATIO:
        return draws
    shift = np.linalg.solve(precision, found[1 : 1 + count])
    if np.abs(shift).max() > _SHIFT:
        return draws
    unit = np.linalg.cholesky(np.linalg.inv(precision)) @ y
    return np.asarray(middle + (scale @ (shift[:, np.newaxis] + unit)).T)
