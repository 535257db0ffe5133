"""One batch of log densities, checked."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array

LogDensity: TypeAlias = Callable[[Array], Array]


def evaluate(log_density: LogDensity, x: Array) -> Array:
    """Return log densities (m,) of points x (m, p) in an array of our own.

    Not-a-number counts as impossible: such a point is never accepted.

    Raises:
        InputError: the result has another shape.
    """
    values = np.array(log_density(x), dtype=np.float64)
    if values.shape != (len(x),):
        raise InputError(
            f'the log density returned shape {values.shape} for {len(x)} points; '
            f'it must return ({len(x)},)'
        )
    return values


def refuse_infinite(point: Array) -> None:
    """Raise for a point (p,) whose log density is plus infinity.

    Raises:
        InputError: always.
    """
    raise InputError(
        f'the log density is plus infinity at {point.tolist()}: errors without any spread cannot '
        'be weighed; check that measured is not a copy of the simulation'
    )


def check_values(values: Array, x: Array) -> None:
    """Look at the log densities (m,) of the start.

    Raises:
        InputError: none is finite, or one is plus infinity.
    """
    if np.isposinf(values).any():
        refuse_infinite(x[int(np.isposinf(values).argmax())])
    if not np.isfinite(values).any():
        raise InputError(
            f'the log density is not finite at any of {len(x)} points to start from; '
            'check the bounds, the units and the records'
        )
