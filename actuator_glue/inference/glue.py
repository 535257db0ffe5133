"""GLUE's behavioural models: which parameter sets count, and for how much.

Beven and Binley (1992): sets less likely than a threshold are refused, the others are weighted by
their likelihood. For samples drawn from the prior; posterior draws of the sampler come with the
right density and need no weights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.records import Array


def behavioural(
    log_likelihood: ArrayLike, *, margin: float | None = None, share: float | None = None
) -> Array:
    """Return weights (m,) of parameter sets drawn from the prior; they sum to one.

    Exactly one threshold is given.

    Args:
        log_likelihood: of each set, (m,); not-a-number and minus infinity never count.
        margin: a set is behavioural if its log likelihood is at most this far below the best.
        share: the best share of all sets, in (0, 1], is behavioural.

    Raises:
        InputError: not one threshold, a threshold out of range, or no finite likelihood.
    """
    values = np.asarray(log_likelihood, dtype=np.float64)
    if (margin is None) == (share is None):
        raise InputError('give one threshold: either margin or share')
    possible = np.isfinite(values)
    if values.ndim != 1 or not possible.any():
        raise InputError('no parameter set has a finite log likelihood; none is behavioural')
    best = values[possible].max()
    if margin is not None:
        if not margin >= 0.0:
            raise InputError(f'behavioural margin must not be negative, got {margin:g}')
        lowest = best - margin
    else:
        assert share is not None
        if not 0.0 < share <= 1.0:
            raise InputError(f'behavioural share must lie in (0, 1], got {share:g}')
        count = max(round(share * len(values)), 1)
        ranked = np.sort(values[possible])
        lowest = ranked[max(len(ranked) - count, 0)]
    weights = np.where(possible & (values >= lowest), values, -np.inf)
    weights = np.exp(weights - best)
    return np.asarray(weights / weights.sum())


def effective_size(weights: Array) -> float:
    """Number of equally weighted draws worth as much: (sum w)^2 / sum w^2 (Kish 1965)."""
    return float(weights.sum() ** 2 / (weights @ weights))


def weighted_quantiles(values: Array, probabilities: ArrayLike, weights: Array) -> Array:
    """Quantiles of the weighted empirical distribution, as GLUE takes its prediction limits.

    Args:
        values: (m,) or (m, n).
        probabilities: (q,) in [0, 1].
        weights: (m,), any positive scale.

    Returns:
        (q,) or (q, n).
    """
    levels = np.asarray(probabilities, dtype=np.float64)
    return np.asarray(np.quantile(values, levels, axis=0, method='inverted_cdf', weights=weights))
