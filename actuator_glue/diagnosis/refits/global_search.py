"""Refit where friction holds the piston: a global search before Gauss-Newton steps.

Whether a stroke breaks free or not changes the error abruptly. So the error has many minima, and
the fit of Eq. (2), which takes friction for a slow actuator, is a start far from the lowest: for
150 N, 110 N were found with a standard deviation of 2 N, the error four times the noise.
Differential evolution (Storn & Price 1997) needs no slope.

One stiffness also leaves a ridge, along which friction grows with the oil's stiffness and only
leakage tells the position. In N it is bent: for 300 N, 2600 N were found, and then another hold of
the command, or a gain, to make up for it. So under one stiffness friction is fitted as a share.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.each import Each
from actuator_glue.inference.least_squares.fit import Fit, base_starts, fit
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space, sum_of_squares
from actuator_glue.model.effects import scale
from actuator_glue.model.parameters import BASE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_P = len(BASE)
_POPULATION = 32  # as many as the kernel works on at a time
_GENERATIONS = 80
_STRAIGHT = 25  # iterations along a ridge
_LEAST = 1.0  # N of friction, where it is a logarithm
_SEED = 0


class Shares(Space):
    """Coordinates with forces as shares of the stiffness of oil and specimen.

    That is where `Parameter.coordinate` is a share, and for alpha_1 beta_0, alpha_3 (with a
    specimen) and the break-away force of Stribeck friction, a logarithm like all positive
    parameters. Their bounds are still those in N.

    Args:
        model: whose parameters they are.
        duration: of the longest record [s].
        stiffness: of the specimen in all records [N/m].
    """

    def __init__(self, model: Model, duration: float, stiffness: float) -> None:
        super().__init__(model, duration)
        self._stiffness = stiffness
        parameters = model.parameters
        self._breaks = [i for i, p in enumerate(parameters) if p.coordinate == 'sliding-force']
        shared = [p.coordinate in ('share', 'sliding-force') for p in parameters]
        shared[1], shared[3] = True, stiffness > 0.0
        self._shared = np.array(shared)
        self._log = np.array([p.lower > 0.0 for p in parameters])
        self._log[:_P], self._log[self._breaks] = False, True
        self._box = super().theta(self.lower), super().theta(self.upper)
        low, high = (np.where(self._shared, self._oil(side), 1.0) for side in self._box)
        least = self._box[0].copy()
        least[self._breaks] = _LEAST
        ends = [least / high, self._box[1] / low]
        for i in self._breaks:
            ends[1][i] *= self._box[1][i + 1]
        ends = [np.where(self._log, np.log(np.where(self._log, e, 1.0)), e) for e in ends]
        self.lower, self.upper = (np.concatenate([np.log(e[:_P]), e[_P:]]) for e in ends)
        self._steps[_P:] = 1e-4 * (self.upper - self.lower)[_P:]
        self._steps[self._log], self._even = 0.01, self._even | self._log

    def theta(self, z: Array) -> Array:
        """As `Space.theta`."""
        out = super().theta(z)
        out[..., self._log] = np.exp(out[..., self._log])
        for i in self._breaks:
            out[..., i] /= out[..., i + 1]
        return np.clip(np.where(self._shared, out * self._oil(out), out), *self._box)

    def z(self, theta: Array) -> Array:
        """As `Space.z`."""
        out = np.where(self._shared, theta / self._oil(theta), theta)
        for i in self._breaks:
            out[..., i] *= theta[..., i + 1]
        out[..., self._log] = np.log(np.maximum(out[..., self._log], 1e-300))
        return super().z(out)

    def logs(self, z: Array) -> Array:
        """As `Space.logs`."""
        return np.asarray(np.log(self.theta(z)[..., :_P]))

    def log_slopes(self, z: Array) -> Array:
        """As `Space.log_slopes`: a share grows with the oil's stiffness, too."""
        out, oil = super().log_slopes(z), np.exp(z[2])
        out[2, self._shared[:_P]] = oil / (oil + self._stiffness)
        return out

    def _oil(self, theta: Array) -> Array:
        return np.asarray(theta[..., 2:3] + self._stiffness)


def _space(data: Data, model: Model) -> Space:
    stiffness, *others = {r.known_stiffness() for r in data.records}
    return Space(model, data.duration) if others else Shares(model, data.duration, stiffness)


def along_ridge(data: Data, model: Structure, theta: Array) -> Array:
    """Return parameters (p,) refitted along the ridge that one stiffness leaves dry friction.

    Args:
        data: counted samples.
        model: whose parameters they are.
        theta: where to begin, (p,); it is returned where there is no such ridge.
    """
    space = _space(data, model)
    dry = any(entry.group == 'friction' for entry in model.entries)
    if not (dry and isinstance(space, Shares)):
        return theta
    return fit(data, model, theta, iterations=_STRAIGHT, space=space).theta


def refit(
    data: Data,
    model: Structure,
    found: Fit,
    iterations: int,
    tolerance: float,
    each: Each = map,
) -> Fit:
    """Refit a structure from the best of a population around `found` and typical machines.

    Args:
        data: counted samples.
        model: Eq. (2) with one effect, p parameters.
        found: its refit so far, one of the population.
        iterations: most Marquardt steps from the best of the population.
        tolerance: as in `fit`.
        each: simulates the records, several at a time if it can.

    Returns:
        The better of `found` and what the population led to.
    """
    space = _space(data, model)
    sizes = scale(data.records, found.theta)
    typical = [model.starts(base, replace(sizes, theta=base)) for base in base_starts(data)]
    members = space.z(np.concatenate([found.theta[np.newaxis], *typical]))

    def cost(z: Array, /) -> Array:
        return sum_of_squares(data.target - data.simulate(model, space.theta(z.T), each))

    first = members[np.argsort(cost(members.T), kind='stable')[:_POPULATION]]
    best = scipy.optimize.differential_evolution(
        cost,  # type: ignore[arg-type]  # its stubs do not know vectorized=True
        scipy.optimize.Bounds(space.lower, space.upper),
        init=first,
        strategy='best2bin',  # with best1bin one search in 200 ended in a valley beside the lowest
        maxiter=_GENERATIONS,
        mutation=(0.4, 0.9),
        recombination=0.9,
        tol=0.0,
        updating='deferred',
        vectorized=True,
        polish=False,
        seed=_SEED,
    )
    theta = along_ridge(data, model, space.theta(best.x))
    again = fit(data, model, theta, iterations=iterations, tolerance=tolerance)
    return again if again.rms < found.rms else found
