"""Working coordinates of a structure, and the finite differences of its simulation in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.least_squares.data import Data
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array

_P = len(BASE)
# The prior of Table 3 belongs to the paper's plant; other machines lie outside it.
_LOG_LOWER = np.log([1.0, 1e5, 1e2, 1e-4])
UPPER = np.array([2e3, 1e14, 1e10, 1e3])
_LOG_UPPER = np.log(UPPER)
_FAR = 1e6  # of a motion's power: no small step changes it by more


class Space:
    """Working coordinates: logarithms of Eq. (2)'s parameters, an effect's as they are.

    Args:
        model: whose parameters they are.
        duration: of the longest record [s].
        part: of the usual finite-difference steps that is taken.
    """

    def __init__(self, model: Model, duration: float, part: float = 1.0) -> None:
        extra = model.parameters[_P:]
        self.lower = np.concatenate([_LOG_LOWER, [p.lower for p in extra]])
        self.upper = np.concatenate([_LOG_UPPER, [p.upper for p in extra]])
        self._steps = np.concatenate([np.full(_P, 1e-3), 1e-4 * (self.upper - self.lower)[_P:]])
        # A line's phase runs away with its frequency: its step is a part of the resolution.
        line = np.array([False] * _P + [p.unit == 'Hz' for p in extra])
        self._steps[line] = 0.02 / duration
        self._even = line | (np.arange(len(line)) < _P)  # the same step everywhere
        self._part = part

    def theta(self, z: Array) -> Array:
        """Physical parameters of working coordinates (..., p)."""
        out = np.array(z, dtype=np.float64)
        out[..., :_P] = np.exp(out[..., :_P])
        return out

    def z(self, theta: Array) -> Array:
        """Working coordinates of physical parameters (..., p), moved into the bounds."""
        out = np.array(theta, dtype=np.float64)
        out[..., :_P] = np.log(np.maximum(out[..., :_P], 1e-300))
        return np.clip(out, self.lower, self.upper)

    def logs(self, z: Array) -> Array:
        """Logarithms (..., 4) of Eq. (2)'s parameters at working coordinates (..., p)."""
        return np.asarray(z[..., :_P])

    def log_slopes(self, z: Array) -> Array:
        """Derivatives of `logs` to working coordinates, (p, 4), at one point (p,)."""
        return np.eye(len(z), _P)

    def steps(self, z: Array) -> Array:
        """Finite-difference steps (..., p): 1 % of an effect's size, so that kinks average out."""
        steps = np.broadcast_to(self._steps, z.shape).copy()
        larger = np.maximum(0.01 * np.abs(z), steps)
        steps = self._part * np.where(self._even, steps, larger)
        # Step inwards at an upper bound.
        return np.where(z + steps > self.upper, -steps, steps)


def sum_of_squares(error: Array) -> Array:
    """Sum of squares of errors (..., n); infinite where a simulation diverged."""
    with np.errstate(over='ignore', invalid='ignore'):
        sums = np.einsum('...n,...n->...', error, error)
    return np.where(np.isfinite(sums), sums, np.inf)


def diverged(moves: Array, motion: Array) -> NDArray[np.bool_]:
    """Whether differences (..., N) of a motion (N,) come from an unstable model, not a step."""
    return np.asarray(~(sum_of_squares(moves) <= _FAR * (motion @ motion)), dtype=np.bool_)


def jacobian(data: Data, model: Model, space: Space, z: Array, output: Array) -> Array:
    """Finite differences of the simulation at z (s, p) with output (s, N): (s, p, N)."""
    steps = space.steps(z)
    out = _simulated(data, model, space, _moved(z, steps))
    return _differences(data, model, space, (z, steps), (out, output))


def with_jacobian(data: Data, model: Model, space: Space, z: Array) -> tuple[Array, Array]:
    """Simulation at z (s, p), (s, N), and its finite differences (s, p, N), in one go."""
    steps = space.steps(z)
    out = _simulated(data, model, space, np.concatenate([z[:, None], _moved(z, steps)], axis=1))
    return out[:, 0], _differences(data, model, space, (z, steps), (out[:, 1:], out[:, 0]))


def _moved(z: Array, steps: Array) -> Array:
    return np.asarray(z[:, None, :] + steps[:, :, None] * np.eye(z.shape[1]))


def _simulated(data: Data, model: Model, space: Space, z: Array) -> Array:
    return data.simulate(model, space.theta(z.reshape(-1, z.shape[-1]))).reshape(*z.shape[:2], -1)


@np.errstate(over='ignore', invalid='ignore')
def _differences(
    data: Data, model: Model, space: Space, at: tuple[Array, Array], found: tuple[Array, Array]
) -> Array:
    """Differences (s, p, N) over steps (s, p) from z (s, p), of what was simulated there and at z.

    A step over the edge of stability says nothing of the side on which the model is: it is taken
    backwards.
    """
    (z, steps), (out, output) = at, found
    out -= output[:, None, :]
    far = diverged(out, data.target)
    if not far.any():
        out /= steps[:, :, None]
        return out
    over = np.logical_and(far, np.isfinite(output).all(axis=-1, keepdims=True))
    if over.any():
        steps = np.where(over, -steps, steps)
        back = _moved(z, steps)[over]
        inside = ((back >= space.lower) & (back <= space.upper)).all(axis=-1)
        out[over] = 0.0
        which = tuple(rows[inside] for rows in np.nonzero(over))
        moves = data.simulate(model, space.theta(back[inside])) - output[which[0]]
        moves[diverged(moves, data.target)] = 0.0
        out[which] = moves
    out /= steps[:, :, None]
    np.nan_to_num(out, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    return out
