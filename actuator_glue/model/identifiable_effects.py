"""Coordinates of Eq. (2a) with effects, compiled: those of `ridge`, and what straightens effects.

One record tells how an effect acts beside the oil column, not its size in N: forces, masses and
curvatures come as shares of alpha_2 + k. With k = 0 that is all it tells; otherwise nearly.
Where an effect shares coefficients of the inverse response with Eq. (2a) (gain; damping and mass,
whose s^2 adds to d2), the coefficient of both together is the coordinate, since it is what the
record fixes. Every parameter says which coordinate it has (`Parameter.coordinate`):

    gain            g: d2/n0, d1/n0 and d0/n0, each divided by g
    damping         c: d2 + c (beta_1 + s), and ln d1/d2 in place of c
    mass-damping    of the mass m before it: the same with c = m (mass_damping + alpha_3)
    share           of alpha_2 + k
    sliding-force   the break-away force, with the ratio behind it, as a share
    lost-share      what is missing from one, as a share
    flow            of a velocity: counts as flow over alpha_2, the record has it over k + alpha_2
    per-flow        one over such a velocity
    log             its logarithm
    line            amplitudes of a cosine, a sine and their frequency, one after another: the
                    phase in the middle of the record, not at the start of the test
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model import identifiable
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.model.parameters import Coordinate, Parameter
from actuator_glue.records import Array

_njit: Any = partial(njit, fastmath=False)

# In the order of `Coordinate`, in which they are undone.
GAIN, DAMPING, SHARE, SLIDING, MASS_DAMPING, LOST_SHARE, FLOW, PER_FLOW, LOG, LINE = range(10)
# No machine's d0/n0 is larger by more: it would lose ten parts in eleven of its static command.
_STATIC = 10.0
# No servo-valve is slower.
_SLOWEST = 0.1  # 1/s
# No actuator's oil is softer than its specimen by more.
_LEAST_OIL = 100.0


def columns(names: Sequence[str], beside: Sequence[Parameter] = ()) -> NDArray[np.int64]:
    """Return the parameters (c, 2) with a coordinate of their own: column, and which it is.

    Args:
        names: the parameters.
        beside: those that the catalogue does not know, as of learned terms.
    """
    known = (p for e in CATALOGUE.values() for p in e.parameters)
    kinds = {p.name: p.coordinate for p in (*known, *beside)}
    order = get_args(Coordinate)
    found = [(order.index(kind), j) for j, name in enumerate(names) if (kind := kinds.get(name))]
    return np.array([(j, kind) for kind, j in sorted(found)], dtype=np.int64).reshape(-1, 2)


def bounds(at: NDArray[np.int64], k: float, low: Array, high: Array) -> tuple[Array, Array]:
    """Return lower and upper bounds of the effects' coordinates, (p,) each; the first four NaN.

    Shares count beside an oil column of at least a hundredth of the stiffest.
    """
    lower, upper = low.copy(), high.copy()
    lower[:4] = upper[:4] = np.nan
    least = max(k + low[2], 0.01 * (k + high[2]))
    for j, kind in at:
        if kind in (SHARE, SLIDING):
            lower[j], upper[j] = low[j] / least, high[j] / least
        if kind == SLIDING:
            upper[j] *= high[j + 1]
        elif kind == LOST_SHARE:
            lower[j], upper[j] = (1.0 - high[j]) / least, (1.0 - low[j]) / least
        elif kind == GAIN:
            lower[j], upper[j] = 1.0 / high[j], 1.0 / low[j] + _STATIC
        elif kind in (DAMPING, MASS_DAMPING):
            lower[j], upper[j] = math.log(_SLOWEST), math.log(high[0] + high[3])
        elif kind == FLOW:
            lower[j] = 0.0
        elif kind == PER_FLOW:
            upper[j] *= _LEAST_OIL
        elif kind == LINE:  # corners of the box, turned
            lower[j : j + 2], upper[j : j + 2] = 1.5 * low[j : j + 2], 1.5 * high[j : j + 2]
        elif kind == LOG:
            lower[j], upper[j] = math.log(low[j]), math.log(high[j])
    return lower, upper


@_njit
def _split(rate: float, lag: float, inertia: float, s: float) -> tuple[float, float, float]:
    """Return d2/n0 without damping and the damping's share, given ln d1/d2 and d2/n0 with it.

    Third, the log Jacobian in (ln inertia, share).
    """
    own = lag * math.exp(-rate)
    left = lag - s * own
    if not left > 0.0:
        return own, math.nan, -math.inf
    return own, (inertia - own) / left, math.log(inertia / left)


@_njit
def turn(row: Array, j: int, time: float) -> None:
    """Turn a line's amplitudes, of a phase that counts from `time` [s], to one from 0."""
    angle = 2.0 * math.pi * row[j + 2] * time
    c, s = row[j], row[j + 1]
    row[j] = c * math.cos(angle) - s * math.sin(angle)
    row[j + 1] = c * math.sin(angle) + s * math.cos(angle)


@_njit
def _factor(kind: int, theta: Array, oil: Any) -> Any:
    """Return a parameter over its coordinate."""
    if kind == FLOW:
        return oil / theta[2]
    if kind == PER_FLOW:
        return theta[2] / oil
    return oil


@_njit
def physical(
    z: Array,
    k: float,
    low: Array,
    high: Array,
    at: NDArray[np.int64],
    middle: float,
    phi: Array,
    theta: Array,
) -> Any:
    """Fill theta (p,) from coordinates z (p,), return the log Jacobian less a constant.

    It is minus infinity where theta lies outside low..high. `at` is from `columns`, phi (4,) is
    scratch, k the specimen stiffness [N/m], middle the time of the record's middle [s].
    """
    for j in range(4, len(z)):
        theta[j] = z[j]
    lag, inertia, s = math.exp(z[0]), math.exp(z[1]), z[3] if k > 0.0 else 0.0
    log_jacobian = 0.0
    for i in range(len(at)):
        j, kind = at[i, 0], at[i, 1]
        if kind == GAIN:
            below = z[j] - (lag / inertia - s) * s * inertia
            if not below > 0.0:
                return -math.inf
            theta[j] = 1.0 / below
            lag, inertia = lag * theta[j], inertia * theta[j]
            log_jacobian -= 2.0 * math.log(below)
        elif kind in (DAMPING, MASS_DAMPING):
            inertia, viscous, more = _split(z[j], lag, inertia, s)
            if not (viscous >= 0.0 and inertia > 0.0):
                return -math.inf
            theta[j] = viscous
            log_jacobian += more
    phi[0], phi[1], phi[2], phi[3] = math.log(lag), math.log(inertia), z[2], z[3]
    log_jacobian += identifiable.physical(phi, k, low, high, theta)
    if log_jacobian == -math.inf:
        return log_jacobian
    oil = theta[2] + k
    for i in range(len(at)):
        j, kind = at[i, 0], at[i, 1]
        if kind == LINE:
            turn(theta, j, middle)
        elif kind == LOG:
            theta[j] = math.exp(z[j])
            log_jacobian += z[j]
        elif kind == MASS_DAMPING:
            mass = max(theta[j - 1], 1e-9)
            theta[j] = theta[j] * oil / mass - theta[3]
            log_jacobian += math.log(oil / mass)
        elif kind != GAIN:
            factor = _factor(kind, theta, oil)
            theta[j] *= factor
            log_jacobian += math.log(factor)
        if kind == SLIDING:
            ratio = max(theta[j + 1], 1e-3)
            theta[j] /= ratio
            log_jacobian -= math.log(ratio)
        elif kind == LOST_SHARE:
            theta[j] = 1.0 - theta[j]
    for j in range(4, len(z)):
        if not low[j] <= theta[j] <= high[j]:
            return -math.inf
    return log_jacobian


@_njit
def physical_all(
    z: Array,
    k: float,
    low: Array,
    high: Array,
    at: NDArray[np.int64],
    middle: float,
    theta: Array,
    log_jacobian: Array,
) -> None:
    """Fill theta (m, p) and the log Jacobian (m,)."""
    phi = np.empty(4)
    for i in range(len(z)):
        log_jacobian[i] = physical(z[i], k, low, high, at, middle, phi, theta[i])


@_njit
def coordinates_all(
    theta: Array, k: float, low: Array, high: Array, at: NDArray[np.int64], middle: float, z: Array
) -> None:
    """Fill z (m, p) with the coordinates of physical parameters theta (m, p)."""
    # Number by number: numba takes seconds to compile the message of arrays that do not fit.
    for i in range(len(theta)):
        for j in range(theta.shape[1]):
            z[i, j] = theta[i, j]
    identifiable.coordinates_all(theta, k, low, high, z)
    for i in range(len(theta)):
        oil = max(k + theta[i, 2], 1e-9)
        lag, inertia, s = math.exp(z[i, 0]), math.exp(z[i, 1]), z[i, 3] if k > 0.0 else 0.0
        for a in range(len(at)):
            j, kind = at[a, 0], at[a, 1]
            if kind == LINE:
                turn(z[i], j, -middle)
            elif kind == LOG:
                z[i, j] = math.log(theta[i, j])
            elif kind == LOST_SHARE:
                z[i, j] = (1.0 - theta[i, j]) / oil
            elif kind == FLOW:
                z[i, j] *= theta[i, 2] / oil
            elif kind == PER_FLOW:
                z[i, j] *= oil / max(theta[i, 2], 1e-9)
            elif kind != GAIN and kind != MASS_DAMPING:
                z[i, j] = theta[i, j] / oil
            if kind == SLIDING:
                z[i, j] *= theta[i, j + 1]
        for a in range(len(at) - 1, -1, -1):
            j, kind = at[a, 0], at[a, 1]
            if kind == GAIN:
                z[i, j] = 1.0 / theta[i, j] + (lag / inertia - s) * s * inertia / theta[i, j]
                lag, inertia = lag / theta[i, j], inertia / theta[i, j]
            elif kind in (DAMPING, MASS_DAMPING):
                viscous = z[i, j]
                if kind == MASS_DAMPING:
                    viscous = (theta[i, j] + theta[i, 3]) * theta[i, j - 1] / oil
                z[i, j] = math.log(lag / inertia)
                inertia += viscous * (lag - s * inertia)
        z[i, 0], z[i, 1] = math.log(max(lag, 1e-300)), math.log(max(inertia, 1e-300))
