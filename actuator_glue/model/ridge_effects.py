"""Coordinates of Eq. (2a) with effects, compiled: those of `ridge`, and what straightens effects.

One record tells how an effect acts beside the oil column, not its size in N: forces, masses and
curvatures come as shares of alpha_2 + k. With k = 0 that is all it tells; otherwise nearly.
Where an effect shares coefficients of the inverse response with Eq. (2a) (gain; damping and mass,
whose s^2 adds to d2), the coefficient of both together is the coordinate, since it is what the
record fixes:

    gain g:         d2/n0, d1/n0 and d0/n0, each divided by g
    damping c:      d2 + c (beta_1 + s), and ln d1/d2 in place of c
    mass m:         the same with c = m (mass_damping + alpha_3)
    Stribeck:       the break-away force in place of the sliding force
    flow:           velocities count as flow over alpha_2; the record shows flow over k + alpha_2
    supply droop:   logarithm of its time constant
    hum:            its phase in the middle of the record, not at the start of the test
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuator_glue.jit import njit
from actuator_glue.model import ridge
from actuator_glue.records import Array

_njit: Any = partial(njit, fastmath=False)

# Parameters with a coordinate of their own; all others are their own coordinate.
NAMES = (
    'gain', 'damping', 'mass', 'mass_damping', 'coulomb_force', 'sliding_force', 'breakaway_ratio',
    'hardening', 'post_yield_ratio', 'droop_time', 'droop', 'saturation_velocity',
    'hum_cosine', 'hum_sine', 'hum_frequency',
)  # fmt: skip
(
    GAIN, DAMPING, MASS, MASS_DAMPING, COULOMB, SLIDING, BREAKAWAY, HARDENING, POST_YIELD,
    DROOP_TIME, DROOP, SATURATION, COSINE, SINE, FREQUENCY,
) = range(len(NAMES))  # fmt: skip
_SHARES: Final = (DAMPING, MASS, COULOMB, SLIDING, HARDENING)
# No machine's d0/n0 is larger by more: it would lose ten parts in eleven of its static command.
_STATIC = 10.0
# No servo-valve is slower.
_SLOWEST = 0.1  # 1/s
# No actuator's oil is softer than its specimen by more.
_LEAST_OIL = 100.0


def columns(names: Sequence[str]) -> NDArray[np.int64]:
    """Return where each of NAMES stands among a model's parameters, -1 where it does not."""
    return np.array([names.index(n) if n in names else -1 for n in NAMES], dtype=np.int64)


def bounds(at: NDArray[np.int64], k: float, low: Array, high: Array) -> tuple[Array, Array]:
    """Return lower and upper bounds of the effects' coordinates, (p,) each; the first four NaN.

    Shares count beside an oil column of at least a hundredth of the stiffest.
    """
    lower, upper = low.copy(), high.copy()
    lower[:4] = upper[:4] = np.nan
    least = max(k + low[2], 0.01 * (k + high[2]))
    for part in _SHARES:
        j = at[part]
        if j >= 0:
            lower[j], upper[j] = low[j] / least, high[j] / least
    if (j := at[SLIDING]) >= 0:
        upper[j] *= high[at[BREAKAWAY]]
    if (j := at[POST_YIELD]) >= 0:
        lower[j], upper[j] = (1.0 - high[j]) / least, (1.0 - low[j]) / least
    if (j := at[GAIN]) >= 0:
        lower[j], upper[j] = 1.0 / high[j], 1.0 / low[j] + _STATIC
    for part in (DAMPING, MASS_DAMPING):
        if (j := at[part]) >= 0:
            lower[j], upper[j] = math.log(_SLOWEST), math.log(high[0] + high[3])
    if (j := at[SATURATION]) >= 0:
        lower[j] = 0.0
    if (j := at[DROOP]) >= 0:
        upper[j] *= _LEAST_OIL
    for part in (COSINE, SINE):
        if (j := at[part]) >= 0:  # corners of the box, turned
            lower[j], upper[j] = 1.5 * low[j], 1.5 * high[j]
    if (j := at[DROOP_TIME]) >= 0:
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
def turn(row: Array, at: NDArray[np.int64], time: float) -> None:
    """Turn a line's amplitudes, of a phase that counts from `time` [s], to one from 0."""
    angle = 2.0 * math.pi * row[at[FREQUENCY]] * time
    c, s = row[at[COSINE]], row[at[SINE]]
    row[at[COSINE]] = c * math.cos(angle) - s * math.sin(angle)
    row[at[SINE]] = c * math.sin(angle) + s * math.cos(angle)


@_njit
def physical(
    z: Array, k: float, low: Array, high: Array, at: NDArray[np.int64], middle: float, phi: Array,
    theta: Array,
) -> Any:  # fmt: skip
    """Fill theta (p,) from coordinates z (p,), return the log Jacobian less a constant.

    It is minus infinity where theta lies outside low..high. `at` is from `columns`, phi (4,) is
    scratch, k the specimen stiffness [N/m], middle the time of the record's middle [s].
    """
    for j in range(4, len(z)):
        theta[j] = z[j]
    lag, inertia, s = math.exp(z[0]), math.exp(z[1]), z[3] if k > 0.0 else 0.0
    log_jacobian = 0.0
    j = at[GAIN]
    if j >= 0:
        below = z[j] - (lag / inertia - s) * s * inertia
        if not below > 0.0:
            return -math.inf
        theta[j] = 1.0 / below
        lag, inertia = lag * theta[j], inertia * theta[j]
        log_jacobian -= 2.0 * math.log(below)
    viscous = 0.0
    for part in (DAMPING, MASS_DAMPING):
        j = at[part]
        if j >= 0:
            inertia, viscous, more = _split(z[j], lag, inertia, s)
            if not (viscous >= 0.0 and inertia > 0.0):
                return -math.inf
            theta[j] = viscous
            log_jacobian += more
    phi[0], phi[1], phi[2], phi[3] = math.log(lag), math.log(inertia), z[2], z[3]
    log_jacobian += ridge.physical(phi, k, low, high, theta)
    if log_jacobian == -math.inf:
        return log_jacobian
    oil = theta[2] + k
    for part in _SHARES:
        j = at[part]
        if j >= 0:
            theta[j] *= oil
            log_jacobian += math.log(oil)
    j = at[SLIDING]
    if j >= 0:
        ratio = max(theta[at[BREAKAWAY]], 1e-3)
        theta[j] /= ratio
        log_jacobian -= math.log(ratio)
    j = at[MASS_DAMPING]
    if j >= 0:
        mass = max(theta[at[MASS]], 1e-9)
        theta[j] = theta[j] * oil / mass - theta[3]
        log_jacobian += math.log(oil / mass)
    j = at[POST_YIELD]
    if j >= 0:
        theta[j] = 1.0 - theta[j] * oil
        log_jacobian += math.log(oil)
    j = at[SATURATION]
    if j >= 0:
        theta[j] *= oil / theta[2]
        log_jacobian += math.log(oil / theta[2])
    j = at[DROOP]
    if j >= 0:
        theta[j] *= theta[2] / oil
        log_jacobian += math.log(theta[2] / oil)
    j = at[DROOP_TIME]
    if j >= 0:
        theta[j] = math.exp(z[j])
        log_jacobian += z[j]
    if at[COSINE] >= 0:
        turn(theta, at, middle)
    for j in range(4, len(z)):
        if not low[j] <= theta[j] <= high[j]:
            return -math.inf
    return log_jacobian


@_njit
def physical_all(
    z: Array, k: float, low: Array, high: Array, at: NDArray[np.int64], middle: float,
    theta: Array, log_jacobian: Array,
) -> None:  # fmt: skip
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
    ridge.coordinates_all(theta, k, low, high, z)
    for i in range(len(theta)):
        oil = max(k + theta[i, 2], 1e-9)
        lag, inertia, s = math.exp(z[i, 0]), math.exp(z[i, 1]), z[i, 3] if k > 0.0 else 0.0
        for part in _SHARES:
            j = at[part]
            if j >= 0:
                z[i, j] = theta[i, j] / oil
        j = at[SLIDING]
        if j >= 0:
            z[i, j] *= theta[i, at[BREAKAWAY]]
        j = at[POST_YIELD]
        if j >= 0:
            z[i, j] = (1.0 - theta[i, j]) / oil
        j = at[SATURATION]
        if j >= 0:
            z[i, j] *= theta[i, 2] / oil
        j = at[DROOP]
        if j >= 0:
            z[i, j] *= oil / max(theta[i, 2], 1e-9)
        j = at[DROOP_TIME]
        if j >= 0:
            z[i, j] = math.log(theta[i, j])
        if at[COSINE] >= 0:
            turn(z[i], at, -middle)
        for part in (MASS_DAMPING, DAMPING):
            j = at[part]
            if j >= 0:
                viscous = z[i, j]
                if part == MASS_DAMPING:
                    viscous = (theta[i, j] + theta[i, 3]) * theta[i, at[MASS]] / oil
                z[i, j] = math.log(lag / inertia)
                inertia += viscous * (lag - s * inertia)
        j = at[GAIN]
        if j >= 0:
            z[i, j] = 1.0 / theta[i, j] + (lag / inertia - s) * s * inertia / theta[i, j]
            lag, inertia = lag / theta[i, j], inertia / theta[i, j]
        z[i, 0], z[i, 1] = math.log(max(lag, 1e-300)), math.log(max(inertia, 1e-300))
