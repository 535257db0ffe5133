"""Restart a refit from points around where it ended: kinks make many minima.

A gap that closes, a valve that follows late and a piston that sticks each change the response
abruptly where a parameter moves a stroke past their edge. With a valve's play, the fit of a gap
ended at an error of 12.1 um; its lowest minimum leaves 10.4 um. Points that move the simulation as
much as the error that is left reach the next minima; there are as many as the kernels work on at a
time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from actuator_glue.inference.least_squares.data import LANES, Data
from actuator_glue.inference.least_squares.fit import Fit, fit
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import Space, sum_of_squares
from actuator_glue.records import Array

_FAR: Final = 1.5  # times the error that is left: with 0.3 and 4 half of the searches ended early
_STARTS: Final = 3  # the best of the points
_ITERATIONS: Final = 12
_ROUNDS: Final = 4
_GAIN: Final = 2e-3  # of the squared error: a smaller gain is not followed
_FLAT: Final = 1e-6  # of the largest curvature: what is flatter is not followed further
_SEED: Final = 0


def scattered(data: Data, model: Model, found: Fit, tolerance: float) -> Fit:
    """Return the lowest minimum around a refit, from scattered starts; `found` if none is lower.

    Args:
        data: counted samples.
        model: structure with p parameters.
        found: its refit.
        tolerance: as in `fit`.
    """
    space, rng = Space(model, data.duration), np.random.default_rng(_SEED)
    best, work = found, 0
    for _ in range(_ROUNDS):
        points = space.theta(_around(best, space, rng))
        sums = sum_of_squares(data.target - data.simulate(model, points))
        starts = points[np.argsort(sums)[:_STARTS]]
        again = fit(data, model, starts, iterations=_ITERATIONS, tolerance=tolerance)
        work += data.sub_steps(model) + again.work
        if not again.rms**2 < (1.0 - _GAIN) * best.rms**2:
            break
        best = again
    return replace(best, work=work)


def _around(found: Fit, space: Space, rng: np.random.Generator) -> Array:
    """Return points (LANES, p) that move the simulation as much as what is left, if straight."""
    jac = found.jacobian
    scale = np.sqrt(np.maximum(np.einsum('pn,pn->p', jac, jac), 1e-300))
    curvature, ways = np.linalg.eigh(jac @ jac.T / np.outer(scale, scale))
    # The largest is one at least, unless the fit diverged and has no slopes.
    ways /= np.sqrt(np.maximum(curvature, _FLAT * max(curvature[-1], 1.0)))
    along = rng.standard_normal((LANES, len(scale)))
    along *= _FAR * np.linalg.norm(found.error) / np.linalg.norm(along, axis=1, keepdims=True)
    return np.asarray(np.clip(found.z + along @ ways.T / scale, space.lower, space.upper))
