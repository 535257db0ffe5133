"""One batch of log densities, checked."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array

LogDensity: TypeAlias = Callable[[Array], Array]


def evaluate(log_density: LogDensity, x: Array) -> Array:
    """Return log densities (m,) of points x (m, p); not-a-number counts as impossible.

    Raises:
        InputError: the result has another shape, or is plus infinity somewhere.
    """
    # A copy: accepting overwrites rejected entries, and the caller's array may be its own buffer.
    values = np.array(log_density(x), dtype=np.float64)
    if values.shape != (len(x),):
        raise InputError(
            f'the log density returned shape {values.shape} for {len(x)} points; '
            f'it must return ({len(x)},)'
        )
    # The largest is plus infinity or, if any is, not a number: one cheap look at the common case.
    largest = values.max()
    if largest == np.inf or np.isnan(largest):
        if np.isposinf(values).any():
            at = int(np.isposinf(values).argmax())
            raise InputError(
                f'the log density is plus infinity at {x[at].tolist()}: a residual without '
                'any noise cannot be weighed; check that measured is not a copy of the model'
            )
        values = np.where(np.isnan(values), -np.inf, values)
    return values
