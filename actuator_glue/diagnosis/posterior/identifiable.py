"""Coordinates in which the posterior around a fit is nearly normal.

In the logarithms of Eq. (2)'s parameters the ridge that one stiffness leaves is bent, and a
thousand times longer than wide: points around the fit lie off it, and chains creep. In the
coordinates of `Ridge` it is straight. Records under several stiffnesses leave no such ridge: for
them the working coordinates serve.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space, diverged
from actuator_glue.inference.transforms.inverse_response import Ridge
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array

_P = len(BASE)
# Step of logarithms and normal scores: the third derivative's error is 1e-6 of the first's.
_STEP = 3e-3
# A fit may lie on its bounds, which are rounded on the way to coordinates and back.
_ROUNDING = 1e-9
# Distance from the fit within which shares of a box can resolve alpha_2, of which the cube counts,
# or without a specimen the square, and then alpha_3 as well: beyond it they are not known.
_HELD_REACH, _FREE_REACH = 2.5, 3.8  # logarithm


def coordinates(space: Space, model: Model, data: Data, fit: Array) -> Working | Straight:
    """Return the coordinates to sample in, around a fit in working coordinates (p,)."""
    if len({record.known_stiffness() for record in data.records}) == 1:
        straight = Straight(space, model, data, fit)
        back, log_prior = straight.inverse(straight.forward(space.theta(fit)[None]))
        # A fit in a corner of its bounds may have no straight coordinates.
        if np.isfinite(log_prior[0]) and np.allclose(back[0], space.theta(fit), rtol=1e-3):
            return straight
    return Working(space)


class Working:
    """The working coordinates themselves, as a `Transform` of the physical parameters.

    Attributes:
        widest: spreads (p,) beyond which nothing is known.
        box: lower and upper bounds of single coordinates, (p,) each.
    """

    def __init__(self, space: Space) -> None:
        self._space = space
        self.widest = space.upper - space.lower
        margin = _ROUNDING * self.widest
        self.lower, self.upper = space.lower - margin, space.upper + margin
        self.box = self.lower, self.upper
        self.widest[:_P] = 1.0

    def forward(self, theta: Array) -> Array:
        """Return the working coordinates (m, p) of physical parameters (m, p)."""
        return self._space.z(theta)

    def inverse(self, z: Array) -> tuple[Array, Array]:
        """As `Straight.inverse`."""
        inside = ((z >= self.lower) & (z <= self.upper)).all(axis=1)
        return self._space.theta(z), np.where(inside, 0.0, -np.inf)


class Straight:
    """Straight coordinates, as a `Transform` of the physical parameters.

    Args:
        space: the working coordinates; the prior is uniform within their bounds.
        model: whose parameters they are.
        data: records under one stiffness; the middle of the longest is used.
        fit: working coordinates of the fit, (p,).

    Attributes:
        widest: spreads (p,) beyond which nothing is known.
        box: lower and upper bounds of single coordinates, (p,) each; infinite for Eq. (2)'s, of
            which combinations are bounded.
        least: coordinate of alpha_3 at its lower bound, alpha_2 as fitted [1/s]; 0 without a
            specimen, where alpha_3 does not act.
    """

    def __init__(self, space: Space, model: Model, data: Data, fit: Array) -> None:
        self._space = space
        stiffness = data.records[0].known_stiffness()
        middle = 0.5 * data.duration
        reach = np.full(len(fit), np.inf)
        reach[2] = _HELD_REACH
        if stiffness == 0.0:
            reach[2:4] = _FREE_REACH
        low = space.theta(np.maximum(space.lower, fit - reach))
        high = space.theta(np.minimum(space.upper, fit + reach))
        margin = _ROUNDING * np.where(np.arange(len(fit)) < _P, low, high - low)
        low, high = low - margin, high + margin
        names = [p.name for p in model.parameters]
        self._ridge = Ridge(names, low, high, stiffness, middle, model.parameters)
        # Logarithms and normal scores: a coordinate with a wider spread counts as unknown.
        self.widest = np.where(
            np.arange(len(fit)) < _P, 1.0, self._ridge.upper - self._ridge.lower
        )
        self.least = float(low[3] * stiffness / (stiffness + space.theta(fit)[2]))
        if stiffness > 0.0:
            self.widest[3] = self._ridge.upper[3]
        base = np.arange(len(fit)) < _P
        self.box = (
            np.where(base, -np.inf, self._ridge.lower),
            np.where(base, np.inf, self._ridge.upper),
        )
        # Only the parameters have bounds, not the coordinates.
        self.lower, self.upper = np.full(len(fit), -np.inf), np.full(len(fit), np.inf)
        self._ridge.lower, self._ridge.upper = self.lower, self.upper

    def forward(self, theta: Array) -> Array:
        """Return the straight coordinates (m, p) of physical parameters (m, p)."""
        return self._ridge.forward(theta)

    def inverse(self, phi: Array) -> tuple[Array, Array]:
        """Physical parameters (m, p) and log prior density (m,) at straight coordinates (m, p).

        The density is minus infinity outside the bounds, where the parameters mean nothing.
        """
        theta, log_prior = self._ridge.inverse(phi)
        # The Jacobian is for a prior uniform in theta; ours is uniform in its logarithm.
        inside = np.isfinite(log_prior)
        log_prior[inside] -= np.log(theta[inside, :_P]).sum(axis=1)
        return theta, log_prior


def derivatives(
    around: Working | Straight, space: Space, phi: Array, response: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Return a response (N,) and its derivatives (p, N) at coordinates (p,) inside the bounds.

    Central differences, where both sides are inside and stable. One-sided ones are off by the
    response's curvature, some 1e-4 of it, which is more than noise leaves visible along a ridge:
    it looked ten to forty times shorter than it is.

    Args:
        around: the coordinates.
        space: the working coordinates, which know the steps of effects.
        phi: where in them, (p,).
        response: returns the responses (m, N) to physical parameters (m, p).
    """
    z = space.z(around.inverse(phi[None])[0][0])
    stepped = around.forward(space.theta(z + np.diag(space.steps(z))))
    sizes = np.abs(np.diag(stepped) - phi)
    sizes = np.where(sizes > 0.0, sizes, 1e-4 * around.widest)
    sizes[:_P] = _STEP
    steps = np.diag(sizes)
    theta, log_prior = around.inverse(np.concatenate([phi + steps, phi - steps, phi[None]]))
    outside = ~np.isfinite(log_prior)
    theta[outside] = theta[-1]
    found = response(theta)
    outside |= diverged(found - found[-1], found[-1])
    found[outside] = found[-1]
    count = len(phi)
    sides = 2 - outside[:count].astype(int) - outside[count:-1]
    difference = found[:count] - found[count:-1]
    difference /= (sizes * np.maximum(sides, 1))[:, None]
    return found[-1], np.nan_to_num(difference, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
