"""The compensator that is best in its worst percentile over a posterior."""

from __future__ import annotations

import numpy as np
import scipy

from actuator_glue.hybrid.linear_system import Complex
from actuator_glue.records import Array

PERCENTILE = 95.0
DRAWS = 200  # of the posterior
_LINES = 800  # frequencies
_POWER = 0.9995  # share of the target's power up to the highest frequency
_TRIALS = 400
_STEP = np.array([5e-3, 5e-4, 5e-6])  # of the coefficients [-, s, s^2]


def tracking_error(
    gain: Complex, loop: Complex, coefficients: Array, s: Complex, power: Array
) -> Array:
    """Return J2 that each draw reaches with a compensator, (m,).

    With T(s) = C(s) G(s) between target and measured displacement, the target is that of a perfect
    test times (1 + L) / (1 + L T): what lags takes damping and shakes the structure more.

    Args:
        gain: G, measured over commanded, delays included, (m, f).
        loop: L, specimen force over force on the numerical substructure, (m, f).
        coefficients: c_0, c_1, c_2.
        s: frequencies on the imaginary axis, (f,) [rad/s].
        power: of a perfect test's target at these, (f,).
    """
    through = gain * (coefficients[0] + coefficients[1] * s + coefficients[2] * s**2)
    target = power * np.abs((1.0 + loop) / (1.0 + loop * through)) ** 2
    miss = (np.abs(through - 1.0) ** 2 * target).sum(axis=1)
    return np.asarray(np.sqrt(miss / target.sum(axis=1)))


def robust(first: Array, gain: Complex, loop: Complex, s: Complex, power: Array) -> Array:
    """Return c (3,) with the smallest 95th percentile of J2 over the draws.

    Args:
        first: coefficients to begin with, (3,).
        gain: as `tracking_error`, and all that follow.
        loop: (m, f).
        s: (f,).
        power: (f,).
    """

    def worst(x: Array) -> float:
        error = tracking_error(gain, loop, first + _STEP * x, s, power)
        return float(np.percentile(error, PERCENTILE))

    best = scipy.optimize.minimize(
        worst,
        np.zeros(3),
        method='Nelder-Mead',
        options={
            'maxfev': _TRIALS,
            'xatol': 1e-3,
            'fatol': 1e-6,
            'initial_simplex': np.vstack([np.zeros(3), np.eye(3)]),
        },
    ).x
    return np.asarray(first + _STEP * best)


def spectrum(target: Array, period: float) -> tuple[Complex, Array]:
    """Return frequencies s [rad/s] and a target's power at them, (f,) each."""
    power = np.abs(np.fft.rfft(target)[1:]) ** 2
    frequency = np.fft.rfftfreq(len(target), period)[1:]
    last = int(np.searchsorted(np.cumsum(power), _POWER * power.sum())) + 1
    groups = np.array_split(np.arange(last), min(_LINES, last))
    middle = np.array([frequency[g].mean() for g in groups])
    return 2j * np.pi * middle, np.array([power[g].sum() for g in groups])
