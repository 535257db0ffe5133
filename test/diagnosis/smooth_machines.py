"""Machines with one smooth departure from Eq. (2), with nothing of the package in them.

Implicit in the velocity (a quadratic equation), the valve by Heun's rule, 16 kHz.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
_STEPS = 128


@njit
def _valve(error: float, kind: int, size: float) -> float:
    if kind == 1:  # saturates
        return size * np.tanh(error / size)
    if kind == 2:  # rounded overlap: less steep about the centre
        return error - 0.7 * size * np.tanh(error / size)
    return error


@njit
def piston(
    command: Array, period: float, theta: Array, k: float, departure: tuple[int, float]
) -> Array:
    """Displacement at the samples of a held command, from rest (n,) [m].

    Departures: 1 valve that saturates [m], 2 rounded valve [m], 3 damping v|v| [N s^2/m^2],
    4 leakage f|f| [1/(N s)], 5 leakage as through an orifice [N^0.5/s].
    """
    kind, size = departure
    b1, n0, a2, a3 = theta
    h = period / _STEPS
    c = size if kind == 3 else 0.0
    q = f = x = 0.0
    out = np.empty(len(command))
    for i in range(len(command)):
        out[i] = x
        for _ in range(_STEPS):
            drive = n0 * _valve(command[i] - x, kind, size)
            middle = q + 0.5 * h * (drive - b1 * q)
            q += h * (drive - b1 * middle)
            leak = a3 * f
            if kind == 4:
                leak += size * f * abs(f)
            if kind == 5:
                leak += size * f / np.sqrt(abs(f) + 1e-3)
            push = f + h * (middle - leak)
            rest, slope = push - k * x, h * (k + a2)
            v = rest / slope
            if c > 0.0:
                v = np.sign(rest) * (np.sqrt(slope**2 + 4.0 * c * abs(rest)) - slope) / (2.0 * c)
            x += h * v
            f = push - h * a2 * v
    return out
