"""The linear servo-hydraulic model with specimen stiffness, Eqs. (1)-(2b) of the paper."""

from __future__ import annotations

import inspect
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actuator_glue.errors import InputError
from actuator_glue.model import kernel, kernel_lanes
from actuator_glue.records import Array, Hold, Record, check_stiffness

_FIT_SPAN = 0.01  # s of measured samples that give the initial state (at least three samples)


class Difference(NamedTuple):
    """Exact difference equation D(z) x = N(z) u; arrays of shape (3,) or (m, 3).

    Coefficients of z^2, z, 1; `numerator` in m/m.
    """

    numerator: Array
    denominator: Array


def thetas(theta: ArrayLike) -> Array:
    """Return theta as (m, 4), from (4,) or (m, 4).

    Raises:
        InputError: any other shape.
    """
    table = np.ascontiguousarray(theta, dtype=np.float64)
    if table.ndim not in (1, 2) or table.shape[-1] != 4:
        raise InputError(
            f'theta has shape {table.shape}; Eq. (2) takes (4,) or (m, 4): '
            'beta_1, alpha_1_beta_0, alpha_2, alpha_3'
        )
    return table.reshape(-1, 4)


def coefficients(theta: ArrayLike, stiffness: float) -> tuple[Array, Array, Array, Array]:
    """Return n0, d2, d1, d0 of Eq. (2a), x/u = n0 / (d2 s^2 + d1 s + d0).

    Args:
        theta: beta_1, alpha_1_beta_0, alpha_2, alpha_3, shape (4,) or (m, 4).
        stiffness: specimen stiffness k [N/m]; 0 gives Eq. (2b).

    Returns:
        Four arrays of shape () or (m,).

    Raises:
        InputError: wrong shape, or a stiffness that cannot be used.
    """
    k = check_stiffness(stiffness)
    # The function itself: it is compiled for one theta, not for arrays of them.
    parts = inspect.unwrap(kernel.equation_2a)(thetas(theta).T, k)
    n0, d2, d1, d0 = (part.reshape(np.shape(theta)[:-1]) for part in parts)
    return n0, d2, d1, d0


def systems(theta: ArrayLike, stiffness: float) -> Array:
    """Return a1, a0, b0 of x'' + a1 x' + a0 x = b0 u, shape (m, 3).

    Where d2 = 0 (alpha_2 = 0 and k = 0) they do not exist and are infinite or NaN; everything
    simulated from them is NaN, and its log-likelihood minus infinity.

    Raises:
        InputError: wrong shape, or a stiffness that cannot be used.
    """
    out: Array = kernel.systems(thetas(theta), check_stiffness(stiffness))
    return out


def table(theta: ArrayLike, stiffness: float, period: float, hold: Hold = 'zoh') -> Array:
    """Return the kernel's coefficients of every theta, shape (m, kernel.COLUMNS)."""
    foh: bool = hold == 'linear'
    out: Array = kernel.discretise(systems(theta, stiffness), period, foh)
    return out


def discretise(
    theta: ArrayLike, stiffness: float, period: float, hold: Hold = 'zoh'
) -> Difference:
    """Return the exact difference equation of Eq. (2a) at one sample period.

    Args:
        theta: shape (4,) or (m, 4).
        stiffness: specimen stiffness k [N/m].
        period: sample period [s].
        hold: 'zoh' where the command is held between its samples, 'linear' where it runs
            straight from one to the next (first-order hold without delay).

    Raises:
        InputError: wrong shape, or a stiffness that cannot be used.
    """
    c = table(theta, stiffness, period, hold)
    one = np.ones(len(c))
    decay, pull = c[:, kernel.DECAY], c[:, kernel.PULL]
    shape = (*np.shape(theta)[:-1], 3)
    return Difference(
        c[:, kernel.G0 : kernel.G2 + 1].reshape(shape),
        np.stack([one, pull - 1.0 - decay, decay], axis=-1).reshape(shape),
    )


def padded(command: ArrayLike) -> Array:
    """Return the command with two samples appended, as the kernels take it."""
    u = np.asarray(command, dtype=np.float64)
    return np.concatenate([u, u[-1:], u[-1:]])


def simulate(
    theta: ArrayLike,
    command: ArrayLike,
    *,
    stiffness: float,
    period: float,
    hold: Hold = 'zoh',
    initial: tuple[float, float] = (0.0, 0.0),
    first: int = 0,
) -> Array:
    """Return the displacement of Eq. (2a) under a sampled command, exact at the samples.

    Args:
        theta: shape (4,) or (m, 4).
        command: commanded displacement u, shape (n,) [m].
        stiffness: specimen stiffness k [N/m].
        period: sample period [s].
        hold: how the command runs between its samples.
        initial: position [m] and velocity [m/s] at the first sample.
        first: samples before this one are simulated but not returned.

    Returns:
        Displacement [m], shape (n - first,) or (m, n - first).

    Raises:
        InputError: wrong shapes, or a stiffness that cannot be used.
    """
    system = systems(theta, stiffness)
    out = respond(system, command, period=period, hold=hold, initial=initial, first=first)
    return out.reshape(*np.shape(theta)[:-1], out.shape[-1])


def respond(
    system: ArrayLike,
    command: ArrayLike,
    *,
    period: float,
    hold: Hold = 'zoh',
    initial: tuple[float, float] = (0.0, 0.0),
    first: int = 0,
) -> Array:
    """Return the response of x'' + a1 x' + a0 x = b0 u, shape (m, n) [m].

    In memory the m responses lie side by side, sample by sample, as bands across them want it.

    Args:
        system: a1 [1/s], a0 [1/s^2], b0 [1/s^2], shape (m, 3).
        command: u, shape (n,) [m].
        period: sample period [s].
        hold: how the command runs between its samples.
        initial: position [m] and velocity [m/s] at the first sample.
        first: samples before this one are stepped through but not returned.

    Raises:
        InputError: the command is not one row of samples.
    """
    u = np.asarray(command, dtype=np.float64)
    if u.ndim != 1 or u.size == 0:
        raise InputError(f'command has shape {u.shape}; one row of samples is needed')
    rows = kernel.discretise(np.ascontiguousarray(system), period, hold == 'linear')
    out = np.empty((len(u) - first, len(rows)))
    x0, v0 = float(initial[0]), float(initial[1])
    kernel_lanes.respond(rows, x0, v0, np.ascontiguousarray(u), first, out)
    return out.T


def initial_samples(record: Record) -> int:
    """Return how many measured samples `initial_state` looks at."""
    return min(len(record), max(3, 1 + round(_FIT_SPAN / record.period)))


def initial_state(record: Record) -> tuple[float, float]:
    """Return position [m] and velocity [m/s] at a record's first sample.

    A straight line is fitted to the first 10 ms of measured displacement, three samples or more.
    """
    n = initial_samples(record)
    time = record.period * (np.arange(n) - 0.5 * (n - 1))
    first = record.measured[:n]
    velocity = float(time @ first / (time @ time))
    return float(first.mean()) + velocity * float(time[0]), velocity


def frequency_response(
    theta: ArrayLike, stiffness: float, frequency_hz: ArrayLike
) -> NDArray[np.complex128]:
    """Return x/u of Eq. (2a) at given frequencies.

    Args:
        theta: shape (4,) or (m, 4).
        stiffness: specimen stiffness k [N/m].
        frequency_hz: shape (nf,) [Hz].

    Returns:
        Complex gain, shape (nf,) or (m, nf); NaN where Eq. (2a) does not exist.

    Raises:
        InputError: wrong shape, or a stiffness that cannot be used.
    """
    s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
    n0, d2, d1, d0 = (part[..., np.newaxis] for part in coefficients(theta, stiffness))
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.asarray(n0 / (d2 * s**2 + d1 * s + d0), dtype=np.complex128)
