"""Quantiles of a mixture of normals: posterior draws, each with a residual around it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.stats import norm

from actuator_glue.inference.bands import Band, check_levels
from actuator_glue.jit import njit
from actuator_glue.records import Array

# Newton squares its relative error: a last step of 1 % leaves 0.01 % of a standard deviation.
_STEPS, _PRECISION = 60, 1e-2
_REACH = 9.0  # standard deviations beyond which there is nothing


@njit
def _quantiles(draws, mean, sd, probability, normal, out):  # type: ignore[no-untyped-def]
    """Solve F(x) = probability, F the mean of the components' distribution functions.

    Newton's steps from the third-order Cornish-Fisher expansion, which is exact for normal draws;
    a step that leaves the bracket, or a density that vanishes between draws, is a bisection.
    """
    m, n = draws.shape
    variance = widest = 0.0
    for i in range(m):
        variance += sd[i] * sd[i] / m
        widest = max(widest, sd[i])
    for j in range(n):
        first = 0.0
        least = most = draws[0, j] + mean[0]
        for i in range(m):
            x = draws[i, j] + mean[i]
            first += x / m
            least, most = min(least, x), max(most, x)
        second = third = 0.0
        for i in range(m):
            d = draws[i, j] + mean[i] - first
            second += d * d / m
            third += d * d * d / m
        scale = math.sqrt(second + variance)
        skewness = third / scale**3
        for q in range(len(probability)):
            z = normal[q]
            low, high = least - _REACH * widest, most + _REACH * widest
            x = first + scale * (z + (z * z - 1.0) * skewness / 6.0)
            x = min(max(x, low), high)
            for _ in range(_STEPS):
                below = density = 0.0
                for i in range(m):
                    u = (x - draws[i, j] - mean[i]) / sd[i]
                    below += 0.5 * math.erfc(-u * 0.7071067811865476)
                    density += 0.3989422804014327 * math.exp(-0.5 * u * u) / sd[i]
                gap = below / m - probability[q]
                if gap > 0.0:
                    high = x
                else:
                    low = x
                new = x - gap * m / density if density > 0.0 else low
                if not low <= new <= high:
                    new = 0.5 * (low + high)
                step = abs(new - x)
                x = new
                if step < _PRECISION * scale:
                    break
            out[q, j] = x


def mixture_band(draws: Array, mean: Array, sd: Array, levels: Sequence[float] | Array) -> Band:
    """Return the central bands of a mixture, sample by sample.

    The same distribution that `inference.predictive.total_band` samples from, computed instead:
    no Monte-Carlo error, and fast enough for every window.

    Args:
        draws: simulated responses, shape (m, n) [m].
        mean: mean of the residual of each draw, shape (m,) [m].
        sd: its standard deviation > 0, shape (m,) [m].
        levels: nominal coverages.

    Raises:
        InputError: a level outside (0, 1).
    """
    wanted = check_levels(levels)
    probability = np.concatenate([(1.0 - wanted) / 2.0, [0.5], (1.0 + wanted) / 2.0])
    out = np.empty((len(probability), draws.shape[1]))
    _quantiles(np.ascontiguousarray(draws), mean, sd, probability, norm.ppf(probability), out)
    count = len(wanted)
    return Band(wanted, out[:count], out[count], out[count + 1 :])
