"""Least-squares refit of a structure: batched Levenberg-Marquardt from several starts.

All finite-difference columns of all starts are one batched simulation. The parameters of Eq. (2)
are fitted as logarithms (they span decades and are positive); those of an effect as they are,
each step scaled by its own curvature (Marquardt 1963), so units do not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.least_squares.data import LANES, Data
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.inference.least_squares.space import (
    Space,
    jacobian,
    sum_of_squares,
    with_jacobian,
)
from actuator_glue.model.parameters import BASE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_P = len(BASE)
_DAMPINGS = np.array([1e-2, 1.0, 1e2])
_STRAIGHT = 0.01  # of the squared motion between two starts may be nonlinear
_FURTHEST = 300.0  # a logarithm: starts farther from a prior are all as bad
_MOST = 1e100  # m^2: more is as good as diverged
_LONG = 100_000  # samples: slopes of more are kept in single precision
_HELD = 4 * 10**7  # values of simulations that are held at a time, where fewer would do: 320 MB
_MORE = 5  # steps as large as its last one by which a start may be behind the best


@dataclass(frozen=True, eq=False)
class Fit:
    """A refitted structure; two are equal only if they are the same object.

    Attributes:
        theta: best parameters, physical units, (p,).
        error: target minus simulation at the counted samples, (N,) [m].
        slopes: derivative of the simulation to the working coordinates, (p, N); of long records
            in single precision, which holds all that finite differences tell.
        z: the working coordinates of `theta`, (p,).
        room: how far their bounds let them move down and up, (2, p); empty for freely.
        work: sub-steps that the kernels took on the way, each for as many simulations as they
            take at a time.
    """

    theta: Array
    error: Array
    slopes: Array | NDArray[np.float32]
    z: Array
    room: Array = field(default_factory=lambda: np.empty((2, 0)))
    work: int = 0

    @property
    def jacobian(self) -> Array:
        """Derivative of the simulation to the working coordinates, (p, N)."""
        return self.jacobian_of(slice(None))

    def jacobian_of(self, rows: NDArray[np.intp] | slice) -> Array:
        """Return the derivative at some of the counted samples, (p, n)."""
        return np.asarray(self.slopes[:, rows], dtype=np.float64)

    @property
    def rms(self) -> float:
        """Rms of the error over the counted samples [m]."""
        return rms(self.error)


def rms(error: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(error**2)))


@np.errstate(over='ignore')  # a step that diverges is worse than any
def _objective(data: Data, space: Space, z: Array, sums: Array) -> Array:
    """Sums of squares (s,) at z (s, p), enlarged by the penalty of a prior.

    Its logarithm times -N/2 is the log posterior density, the noise integrated out. However far
    from the prior a start is, it is finite: differences of starts are asked for.
    """
    if data.prior is None:
        return sums
    square = (data.prior.pull(space.logs(z)) ** 2).sum(axis=-1)
    return np.asarray(sums * np.exp(np.minimum(square / data.target.size, _FURTHEST)))


def _informed(
    data: Data, space: Space, z: Array, jac: Array, error: Array, square: float
) -> tuple[Array, Array]:
    """Jacobian (p, N) and error (N,) at z, with rows for a prior in units of the error's rms."""
    if data.prior is None:
        return jac, error
    size = np.sqrt(square / data.target.size)
    logs = space.logs(z)
    more = size * space.log_slopes(z) @ data.prior.slopes(len(logs))
    return np.hstack([jac, more]), np.concatenate([error, -size * data.prior.pull(logs)])


@np.errstate(all='ignore')  # a start that diverges proposes nothing worth taking
def _proposals(jac: Array, error: Array, z: Array, dampings: Array, space: Space) -> Array:
    """Marquardt steps of one start for several dampings (d,), kept inside the bounds: (d, p)."""
    normal, pull = jac @ jac.T, jac @ error
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    normal, pull = normal / np.outer(scale, scale), pull / scale
    out = np.empty((len(dampings), len(z)))
    for i, damping in enumerate(dampings):
        free = np.ones(len(z), dtype=np.bool_)
        step = np.zeros(len(z))
        # Parameters that would leave their bound from it are held (active set).
        for _ in range(len(z)):
            step[:] = 0.0
            a = normal[np.ix_(free, free)] + damping * np.eye(int(free.sum()))
            try:
                step[free] = np.linalg.solve(a, pull[free])
            except np.linalg.LinAlgError:
                step[free] = np.linalg.lstsq(a, pull[free], rcond=None)[0]
            move = step / scale
            out_of = free & (((z >= space.upper) & (move > 0)) | ((z <= space.lower) & (move < 0)))
            if not out_of.any():
                break
            free &= ~out_of
            if not free.any():
                break
        move = np.where(free, step / scale, 0.0)
        move[:_P] = np.clip(move[:_P], -1.5, 1.5)
        out[i] = np.clip(z + move, space.lower, space.upper)
    return out


def fit(
    data: Data,
    model: Model,
    starts: Array,
    *,
    iterations: int = 25,
    tolerance: float = 1e-6,
    space: Space | None = None,
) -> Fit:
    """Refit all parameters of a structure by least squares on the free-run error.

    Where the data have a prior, to the most probable parameters.

    Args:
        data: counted samples.
        model: structure with p parameters.
        starts: physical starting values, (p,) or (s, p).
        iterations: most Marquardt steps of each start.
        tolerance: relative decrease of the sum of squares below which a start is done.
        space: coordinates, if not the working ones.

    Returns:
        The best of all starts.
    """
    space = space or Space(model, data.duration)
    z = space.z(np.atleast_2d(starts))
    found, ahead = _tried(data, model, space, z[:, None])
    size, p, length = data.target.size, z.shape[1], data.sub_steps(model)
    passes = _passes(len(z) * (1 if ahead is None else p + 1))
    output = found[:, 0]
    error = data.target - output
    sse = sum_of_squares(error)
    alive = sse < _MOST
    z, output, error, sse = z[alive], output[alive], error[alive], sse[alive]
    cost = _objective(data, space, z, sse)
    if not len(z):
        first = space.z(np.atleast_2d(starts))[0]
        # Every start diverged: a metre of error, which nothing prefers.
        return Fit(
            space.theta(first), np.ones(size), np.zeros((p, size)), first, work=passes * length
        )
    damping, pace = np.full(len(z), 1e-2), cost.copy()
    active = np.ones(len(z), dtype=np.bool_)
    slopes = [None if ahead is None else ahead[i, 0] for i in np.flatnonzero(alive)]
    for iteration in range(iterations):
        rows = np.flatnonzero(active)
        if not rows.size:
            break
        lead = int(rows[np.argmin(cost[rows])])
        others = rows[rows != lead]
        # Slopes of all starts at once where that takes no longer, else those of the best first.
        for wanted in ([lead] if rows.size * z.shape[1] > LANES else rows, rows):
            new = [r for r in wanted if active[r] and slopes[r] is None]
            if new:
                some = jacobian(data, model, space, z[new], output[new])
                passes += _passes(len(new) * p)
                for r, jac in zip(new, some, strict=True):
                    slopes[r] = jac
            if others.size and (best_jac := slopes[lead]) is not None:
                steps, moves = z[others] - z[lead], output[others] - output[lead]
                # The motion is linear between them: both lead to the same minimum.
                beyond = sum_of_squares(moves - steps @ best_jac)
                most = np.maximum(_STRAIGHT * sum_of_squares(moves), tolerance * sse[lead])
                active[others[beyond < most]] = False
        rows = np.flatnonzero(active)
        # Two steps of each start with their slopes take no longer than three without.
        each = rows.size * (p + 1)
        factors = _DAMPINGS[: 2 if 2 * each <= LANES < 3 * each else 3]
        tries = np.stack(
            [
                _proposals(
                    *_informed(data, space, z[r], jac, error[r], sse[r]),
                    z[r],
                    damping[r] * factors,
                    space,
                )
                for r in rows
                if (jac := slopes[r]) is not None
            ]
        )
        tried, ahead = _tried(data, model, space, tries)
        passes += _passes(len(rows) * tries.shape[1] * (1 if ahead is None else p + 1))
        for i, r in enumerate(rows):
            errors = data.target - tried[i]
            sums = sum_of_squares(errors)
            costs = _objective(data, space, tries[i], sums)
            best = int(np.argmin(costs))
            if costs[best] < cost[r]:
                pace[r], before = cost[r] - costs[best], cost[r]
                z[r], output[r] = tries[i, best], tried[i, best]
                error[r], sse[r], cost[r] = errors[best], sums[best], costs[best]
                slopes[r] = None if ahead is None else ahead[i, best].copy()
                damping[r] = min(max(damping[r] * _DAMPINGS[best] * 0.3, 1e-9), 1e6)
                active[r] = pace[r] > tolerance * before
            else:
                damping[r] *= 1e3
                active[r] = damping[r] < 1e7
        # A start is given up that would not catch up with the best in some more such steps.
        if iteration >= 2:
            active &= cost - _MORE * pace <= cost.min()
        if iteration >= 4:
            active &= cost < 1.5 * cost.min()
    best = int(np.argmin(cost))
    final = slopes[best]
    if final is None:
        final = jacobian(data, model, space, z[best : best + 1], output[best : best + 1])[0]
        passes += _passes(p)
    # Copies: views would keep what all starts left.
    room = np.stack([space.lower, space.upper]) - z[best]
    kept = final.astype(np.float32 if final.shape[1] > _LONG else np.float64)
    theta, error_left = space.theta(z[best]), error[best].copy()
    return Fit(theta, error_left, kept, z[best].copy(), room, work=passes * length)


def _passes(simulations: int) -> int:
    return -(-simulations // LANES)


def _tried(data: Data, model: Model, space: Space, tries: Array) -> tuple[Array, Array | None]:
    """Simulate steps tried (s, d, p): (s, d, N).

    With their finite differences (s, d, p, N), of which the next step needs one in d, where the
    kernels take no longer for all of them and memory holds them; else None.
    """
    s, d, p = tries.shape
    flat = tries.reshape(-1, p)
    count = len(flat) * (p + 1)
    if count > LANES or count * data.target.size > _HELD:
        return data.simulate(model, space.theta(flat)).reshape(s, d, -1), None
    out, slopes = with_jacobian(data, model, space, flat)
    return out.reshape(s, d, -1), slopes.reshape(s, d, p, -1)


def base_starts(data: Data) -> Array:
    """Starting values of Eq. (2) that span what laboratories have, physical units (s, 4)."""
    starts = []
    for beta in (60.0, 180.0, 400.0):
        for omega in (20.0, 60.0, 120.0):
            for stiff in (2e5, 4e6):
                # d2 s^2 + ... + n0 with n0 = omega^2 d2
                starts.append([beta, omega**2 * stiff, stiff, 0.3])
    if data.prior is not None:
        starts.append(data.prior.start(np.array(starts[len(starts) // 2])).tolist())
    return np.array(starts)


def base_fit(data: Data) -> Fit:
    """Fit Eq. (2) from a grid of starts."""
    model, starts = Structure(()), base_starts(data)
    sums = sum_of_squares(data.target - data.simulate(model, starts))
    return fit(data, model, starts[np.argsort(sums)[:4]], iterations=60)
