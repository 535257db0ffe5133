"""What Eq. (2), refitted, leaves of a clean response, and sizes that leave a given ratio."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import interpolate, optimize, signal

Array = NDArray[np.float64]
NOISE = 1e-5  # m


# What a sensor does between two samples is computed at so many times in each: a held command
# leaves ripples there, 2 um of 4 mm at 10 Hz, which no curve through the samples shows.
FINE = 16


def between(y: Array, at: Array) -> Array:
    """Motion (n,) at any places of it; straight lines would lose what is curved."""
    motion = interpolate.CubicSpline(np.arange(len(y)), y)
    return np.asarray(motion(np.clip(at, 0.0, len(y) - 1.0)))


def base_response(theta: Array, command: Array, k: float, rate: float) -> Array:
    """Eq. (2a) with its command held, exact [m]."""
    b1, n0, a2, a3 = theta
    den = [k + a2, a3 * k + b1 * (k + a2), b1 * a3 * k + n0]
    num, den_z, _ = signal.cont2discrete(([n0], den), 1 / rate, 'zoh')
    return np.asarray(signal.lfilter(num.ravel(), den_z, command))


def base_residual(
    theta: Array,
    commands: Sequence[Array],
    measured: Sequence[Array],
    stiffness: Sequence[float],
    rate: float,
) -> float:
    """Rms that remains after Eq. (2) is refitted to the first two records [m]."""

    def errors(log_theta: Array) -> Array:
        p = np.exp(np.clip(log_theta, -20, 40))
        rows = zip(commands[:2], measured[:2], stiffness[:2], strict=True)
        return np.concatenate(
            [1e5 * (y[::2] - base_response(p, u, k, rate)[::2]) for u, y, k in rows]
        )

    start = np.log(np.maximum(theta, 1e-3))
    fit = optimize.least_squares(errors, start, x_scale=0.1, max_nfev=60)
    return float(1e-5 * np.sqrt(np.mean(fit.fun**2)))


def sized(
    names: Sequence[str],
    table: dict[str, tuple[float, float]],
    ratio_of: Callable[[dict[str, float]], float],
    target: float,
) -> tuple[dict[str, float], float]:
    """Find sizes whose post-refit residual is about `target` times the noise (log bisection)."""
    low, high = 0.0, 1.0
    best: tuple[float, dict[str, float], float] = (np.inf, {}, 0.0)
    share = 0.5
    for _ in range(7):
        sizes = {n: float(table[n][0] * (table[n][1] / table[n][0]) ** share) for n in names}
        ratio = ratio_of(sizes)
        if np.isfinite(ratio) and abs(np.log(ratio / target)) < best[0]:
            best = (abs(float(np.log(ratio / target))), sizes, ratio)
        if best[0] < 0.15:
            break
        low, high = (share, high) if ratio < target else (low, share)
        share = 0.5 * (low + high)
    return best[1], best[2]
