"""Coordinates in which one record's posterior is nearly a normal distribution in a box.

Under one specimen stiffness k, Eq. (2a) divided by n0 is the inverse of the response,

    u/x = (d2/n0) s^2 + (d1/n0) s + d0/n0.

The record's error is, to first order, linear in these three coefficients, and so are their
posterior's ridges straight. In the physical parameters, and in d1/d2 and d0/d2, the same ridge is
bent, a thousand times longer than wide: a sampler creeps. The sampling coordinates are

    ln d1/n0 [s], ln d2/n0 [s^2], alpha_3 k/(k + alpha_2) [1/s],

which fix the three coefficients, and alpha_2, of which one record says nothing more, as the share
of the way from its least to its largest value inside the prior's box given the other three (as
a normal score, so that a prior-dominated posterior has no wall and is normal). The prior stays
uniform in the physical parameters: given the other coordinates, (k + alpha_2)^3 is uniform. At
k = 0 alpha_3 does not act: it is the normal score of its place in the box; alpha_2^2 is uniform.

With effects: `model.identifiable_effects` says what their coordinates are, and what remains bent
is straightened by what an earlier posterior has shown (`triangular`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from actuator_glue.inference.compiled import Compiled
from actuator_glue.model import identifiable, identifiable_effects
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array

# ln d1/n0 (lag of the loop, 1 us .. 1000 s) and ln d2/n0 (natural frequency 1000 .. 0.05 Hz): no
# servo-hydraulic actuator is outside; logarithms need limits, since the prior reaches zero.
_LAG = (float(np.log(1e-6)), float(np.log(1e3)))
_INERTIA = tuple(float(-2.0 * np.log(2.0 * np.pi * f)) for f in (1000.0, 0.05))


class Ridge:
    """Transform of the model's parameters under one stiffness to straight coordinates.

    Args:
        names: the parameters; the first four are those of Eq. (2).
        low: lower bounds of the parameters, (p,).
        high: upper bounds, (p,).
        stiffness: specimen stiffness k [N/m].
        middle: time of the record's middle since the test began [s].
        beside: parameters that the catalogue does not know, as of learned terms.
    """

    def __init__(
        self,
        names: Sequence[str],
        low: Array,
        high: Array,
        stiffness: float,
        middle: float = 0.0,
        beside: Sequence[Parameter] = (),
    ) -> None:
        self._low, self._high = low, high
        self._k = stiffness
        self._middle = middle
        self._at = identifiable_effects.columns(names, beside)
        self.lower, self.upper = identifiable_effects.bounds(self._at, stiffness, low, high)
        self.lower[:4], self.upper[:4] = -identifiable.EDGE, identifiable.EDGE
        self.lower[0], self.upper[0] = _LAG
        self.lower[1], self.upper[1] = _INERTIA
        if stiffness > 0.0:
            self.lower[3] = low[3] * stiffness / (stiffness + high[2])
            self.upper[3] = high[3] * stiffness / (stiffness + low[2])
        # The sampler takes logarithms above a lower bound of 0, which bends what is straight. A
        # bound just below is none; the parameters' bounds are checked all the same.
        self.lower = np.where(self.lower == 0.0, -1e-6 * self.upper, self.lower)

    def forward(self, x: Array) -> Array:
        """Return the coordinates (m, p) of parameters (m, p), moved inside the bounds."""
        x = np.ascontiguousarray(x, dtype=np.float64)
        z = np.empty_like(x)
        identifiable_effects.coordinates_all(
            x, self._k, self._low, self._high, self._at, self._middle, z
        )
        return np.clip(z, self.lower, self.upper)

    def inverse(self, z: Array) -> tuple[Array, Array]:
        """Return the parameters (m, p) of coordinates (m, p), and ln |dx/dz| (m,)."""
        z = np.ascontiguousarray(z, dtype=np.float64)
        x, log_jacobian = np.empty_like(z), np.empty(len(z))
        if len(self._low) == 4:
            identifiable.physical_all(z, self._k, self._low, self._high, x, log_jacobian)
        else:
            identifiable_effects.physical_all(
                z, self._k, self._low, self._high, self._at, self._middle, x, log_jacobian
            )
        return x, log_jacobian

    def opened(self, x: Array, rng: np.random.Generator) -> Array:
        """Return (n, p), n at most m, of parameters (m, p), redrawn where one stiffness is open.

        That is alpha_2 given the others' coordinates, at k = 0 alpha_3, too: it is drawn from the
        prior in the box. A draw that takes another parameter out of the box is dropped.
        """
        z = self.forward(x)
        left = [2] if self._k > 0.0 else [2, 3]
        z[:, left] = rng.standard_normal((len(z), len(left)))
        out, log_jacobian = self.inverse(np.clip(z, self.lower, self.upper))
        return np.asarray(out[np.isfinite(log_jacobian)])

    def compiled(self, form: Compiled) -> Compiled | None:
        """Return the compiled form of a log likelihood in these coordinates, if there is one."""
        if len(self._low) != 4:
            return None
        return form._replace(mapped=True, stiffness=self._k, low=self._low, high=self._high)
