"""Machines with one departure from Eq. (2), with nothing of the package in them.

Implicit in the velocity (a quadratic equation), the valve by Heun's rule, 16 kHz.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
_STEPS = 128
_WARM = 8.0  # s, time constant of what settles
_SLIP = 1e-3  # m/s, where friction is nearly all there
_BRISTLE = 5e-6  # m, before it slides (LuGre without a Stribeck curve)


@njit
def _valve(error: float, kind: int, size: float) -> float:
    if kind == 1:  # saturates
        return size * np.tanh(error / size)
    if kind == 2:  # rounded overlap: less steep about the centre
        return error - 0.7 * size * np.tanh(error / size)
    return error


@njit
def _late(before: float, now: float, half: float) -> float:
    """Where something with play stands that was at `before`."""
    if now > before + half:
        return now - half
    if now < before - half:
        return now + half
    return before


@njit
def _sliding(rest: float, slope: float, friction: float) -> float:
    """The velocity at which slope v + friction tanh(v/1 mm/s) is what is left to push."""
    low, high = min(0.0, rest / slope), max(0.0, rest / slope)
    v = 0.5 * (low + high)
    for _ in range(60):
        r = np.tanh(v / _SLIP)
        over = slope * v + friction * r - rest
        if over > 0.0:
            high = v
        else:
            low = v
        step = over / (slope + friction * (1.0 - r * r) / _SLIP)
        v -= step
        if not low <= v <= high:
            v = 0.5 * (low + high)
        if abs(step) < 1e-12:
            break
    return v


@njit
def _bent(bristle: float, v: float, h: float) -> float:
    """Deflection after a step h of z' = v - |v| z/_BRISTLE, implicit [m]."""
    return (bristle + h * v) / (1.0 + h * abs(v) / _BRISTLE)


@njit
def _held_back(rest: float, slope: float, friction: float, bristle: float, h: float) -> float:
    """The velocity at which slope v + friction z/_BRISTLE is what is left to push."""
    high = (abs(rest) + friction) / slope
    low = -high
    for _ in range(60):
        v = 0.5 * (low + high)
        if slope * v + friction * _bent(bristle, v, h) / _BRISTLE > rest:
            high = v
        else:
            low = v
    return 0.5 * (low + high)


@njit
def piston(
    command: Array, period: float, theta: Array, k: float, departure: tuple[int, float]
) -> Array:
    """Displacement at the samples of a held command, from rest (n,) [m].

    Departures: 1 valve that saturates [m], 2 rounded valve [m], 3 damping v|v| [N s^2/m^2],
    4 leakage f|f| [1/(N s)], 5 leakage as through an orifice [N^0.5/s], 6 play of the command,
    7 of the controller's own transducer, 8 of half of the valve, the other half without, half
    widths [m], 9 flow that grows by a share as it warms, 10 specimen that stiffens by a share,
    11 friction as tanh(v/1 mm/s), 12 that of the specimen's support [N], 13 flow that falls with
    the square of the position [1/m^2], 14 friction of a bristle that bends by 5 um [N], 15 damping
    of the way back only [N s/m].
    """
    kind, size = departure
    b1, n0, a2, a3 = theta
    h = period / _STEPS
    c = size if kind == 3 else 0.0
    q = f = x = late = bristle = 0.0
    out = np.empty(len(command))
    for i in range(len(command)):
        out[i] = x
        for j in range(_STEPS):
            warm = 1.0 - np.exp(-(i + j / _STEPS) * period / _WARM)
            error = command[i] - x
            if kind == 6:
                late = _late(late, command[i], size)
                error = late - x
            if kind == 7:
                late = _late(late, x, size)
                error = command[i] - late
            if kind == 8:
                late = _late(late, error, size)
                error = 0.5 * (error + late)
            drive = n0 * _valve(error, kind, size)
            middle = q + 0.5 * h * (drive - b1 * q)
            q += h * (drive - b1 * middle)
            flow = middle * (1.0 + size * warm) if kind == 9 else middle
            if kind == 13:
                flow = middle * (1.0 - size * x * x)
            stiff = k * (1.0 + size * warm) if kind == 10 else k
            leak = a3 * f
            if kind == 4:
                leak += size * f * abs(f)
            if kind == 5:
                leak += size * f / np.sqrt(abs(f) + 1e-3)
            push = f + h * (flow - leak)
            rest, slope = push - stiff * x, h * (stiff + a2)
            v = rest / slope
            if c > 0.0:
                v = np.sign(rest) * (np.sqrt(slope**2 + 4.0 * c * abs(rest)) - slope) / (2.0 * c)
            if kind == 11 or (kind == 12 and k > 0.0):
                v = _sliding(rest, slope, size)
            if kind == 15 and rest < 0.0:
                v = rest / (slope + size)
            if kind == 14:
                v = _held_back(rest, slope, size, bristle, h)
                bristle = _bent(bristle, v, h)
            x += h * v
            f = push - h * a2 * v
    return out
