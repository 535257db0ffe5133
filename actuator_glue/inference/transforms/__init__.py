"""Sampling coordinates: one-to-one maps between parameters and what a sampler moves in.

One file a transform. What every transform must pass is in test/inference/test_transforms.py.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from actuator_glue.records import Array


class Transform(Protocol):
    """A one-to-one map between parameters x (m, p) and coordinates z (m, p).

    Attributes:
        lower: lower bounds of the coordinates, (p,).
        upper: upper bounds, (p,).
    """

    @property
    def lower(self) -> Array:
        """Lower bounds of the coordinates, (p,)."""
        ...

    @property
    def upper(self) -> Array:
        """Upper bounds of the coordinates, (p,)."""
        ...

    def forward(self, x: Array, /) -> Array:
        """Return the coordinates (m, p) of parameters (m, p), moved inside the bounds."""
        ...

    def inverse(self, z: Array, /) -> tuple[Array, Array]:
        """Return the parameters (m, p) of coordinates (m, p), and ln |dx/dz| (m,).

        The logarithm is less a constant, and minus infinity where there is no such parameter.
        """
        ...


class Composed:
    """Transform made of two: parameters x, what lies between, coordinates z.

    Args:
        first: from the parameters to what lies between.
        second: from there to the coordinates; its bounds are those of the whole.
    """

    def __init__(self, first: Transform, second: Transform) -> None:
        self.first, self.second = first, second
        self.lower, self.upper = second.lower, second.upper

    def forward(self, x: Array) -> Array:
        """Return the coordinates (m, p) of parameters (m, p): see `Transform`."""
        return self.second.forward(self.first.forward(x))

    def inverse(self, z: Array) -> tuple[Array, Array]:
        """Return the parameters (m, p) of coordinates (m, p), and ln |dx/dz| (m,)."""
        between, outer = self.second.inverse(z)
        x, inner = self.first.inverse(between)
        inside = (between >= self.first.lower) & (between <= self.first.upper)
        return x, np.where(inside.all(axis=1), inner + outer, -np.inf)
