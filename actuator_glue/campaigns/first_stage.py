"""What one test says of the parameters of Eq. (2), without what its prior says.

The first stage of a two-stage meta-analysis: a normal distribution of logarithms for each test.
All tests have the same prior, which must not count once a test: what a test leaves to its bounds
is unknown, as oil stiffness and leakage after a test without specimen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.model.parameters import BASE, NAMES
from actuator_glue.records import Array

Flags = NDArray[np.bool_]

# Standard deviation of the logarithm of a parameter that a test does not tell.
UNKNOWN = 10.0
# A direction whose variance is a larger share of the prior's is left to the bounds. Three
# parameters of which only ratios are told have a third of it, a known one far less.
_SHARE = 0.25
# Part of such a direction from which on a parameter has to do with it.
_PART = 0.1
# Share of its upper bound that the largest of 40 draws of a parameter reaches which goes there. A
# leakage near zero has a wide logarithm, too, and is known to be small.
_REACHED = 0.9


def first_stage(
    draws: Array, names: Sequence[str], bounds: Mapping[str, tuple[float, float]] | None = None
) -> dict[str, Any] | None:
    """Return mean and covariance of logarithms for `pooled`; None where draws reach zero.

    A parameter that the test leaves to its bounds has the standard deviation `UNKNOWN`.

    Args:
        draws: shape (m, p), SI units.
        names: of the columns; effects' are left out.
        bounds: of each parameter's uniform prior; None for those of Table 3.
    """
    columns = [i for i, name in enumerate(names) if name in NAMES]
    kept = [names[i] for i in columns]
    some = draws[:, columns]
    some = some[(some > 0.0).all(axis=1)]
    if len(some) < 0.5 * len(draws):
        return None
    logs = np.log(some)
    covariance = np.atleast_2d(np.cov(logs, rowvar=False))
    bounds = bounds or {p.name: (p.lower, p.upper) for p in BASE}
    prior = np.array([_prior_variance(*bounds[n]) for n in kept])
    upper = np.array([bounds[n][1] for n in kept])
    reached = np.quantile(some, 0.975, axis=0) > _REACHED * upper
    unknown = _left_to_bounds(covariance, prior, reached)
    covariance[unknown] = covariance[:, unknown] = 0.0
    covariance[unknown, unknown] = UNKNOWN**2
    return {'names': kept, 'mean': logs.mean(axis=0).tolist(), 'covariance': covariance.tolist()}


def _left_to_bounds(covariance: Array, prior: Array, reached: Flags) -> Flags:
    """Return which parameters (p,) have to do with a direction that the bounds alone limit.

    Not by their own variances: two parameters of which only the ratio is told go to the bounds
    together, and each has half of the prior's variance or less.

    Args:
        covariance: of the logarithms, (p, p).
        prior: variances of the logarithms that the bounds leave, (p,).
        reached: which parameters reach their upper bound, (p,).
    """
    scale = np.sqrt(prior)
    shares, directions = np.linalg.eigh(covariance / np.outer(scale, scale))
    parts = np.abs(directions) > _PART
    limited = (shares > _SHARE) & parts[reached].any(axis=0)
    return np.asarray(parts[:, limited].any(axis=1))


def _prior_variance(lower: float, upper: float) -> float:
    """Return the variance of the logarithm of what is uniform between two bounds."""
    if lower <= 0.0:
        return 1.0
    return float(1.0 - lower * upper * (np.log(upper / lower) / (upper - lower)) ** 2)
