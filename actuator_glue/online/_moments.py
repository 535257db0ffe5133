"""Local double until inference.moments lands."""

from dataclasses import dataclass
import numpy as np
from scipy.stats import skew
from actuator_glue.records import Array


@dataclass
class Moments:
    mean: Array
    stddev: Array
    skewness: Array
    cov: Array
    prior_dominated: Array


def moments(draws, lower, upper):
    mean, sd = draws.mean(axis=0), draws.std(axis=0, ddof=1)
    return Moments(
        mean, sd, skew(draws, axis=0), sd / mean, sd > 0.2 * (upper - lower) / np.sqrt(12)
    )
