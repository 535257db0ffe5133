"""A standard deviation that a few outliers do not move."""

from __future__ import annotations

from typing import Final

import numpy as np

from actuator_glue.records import Array

# Standard deviation of a normal distribution over its median absolute deviation.
NORMAL: Final = 1.4826


def deviation(values: Array, about: float = 0.0) -> float:
    """Return the standard deviation that a normal distribution of the same median size has.

    Args:
        values: (n,), at least one.
        about: their centre [unit of the values].
    """
    return NORMAL * float(np.median(np.abs(values - about)))
