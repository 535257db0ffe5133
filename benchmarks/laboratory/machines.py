"""The laboratory's machines, and what happens to them; no code of the package.

Eq. (2) with its command held is written here from the paper, play and delay from their definition.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Array = NDArray[np.float64]
NAMES = ('beta_1', 'alpha_1_beta_0', 'alpha_2', 'alpha_3')
RATE = 200.0  # Hz
NOISE = 8e-6  # m
STIFFNESS = {'free': 0.0, 'clamped': 250e3}  # N/m
_FINE = 20  # computed steps in a sample
# What a day does to the logarithm of each parameter: oil temperature, zero of the valve.
DAY = np.array([0.010, 0.015, 0.010, 0.08])
# Random walk of the logarithms, per root of a day.
WALK = np.array([0.0004, 0.0006, 0.0004, 0.004])


@dataclass(frozen=True)
class Machine:
    """One actuator.

    Attributes:
        name: of it.
        theta: beta_1, alpha_1 beta_0, alpha_2, alpha_3 at first, SI units.
        drift: of their logarithms in a year.
        repair: share of the campaign after which it is repaired, and what that does to the
            logarithms; None for no repair.
        effect: what comes and goes: 'backlash' [m] or 'delay' [s], its size, and the shares of the
            campaign between which it is there.
    """

    name: str
    theta: tuple[float, float, float, float]
    drift: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    repair: tuple[float, tuple[float, float, float, float]] | None = None
    effect: tuple[str, float, list[tuple[float, float]]] | None = field(default=None)


MACHINES = (
    Machine(
        'north',
        (128.0, 1.01e9, 2.42e5, 0.3),
        repair=(0.45, (0.12, -0.10, 0.0, 0.0)),  # another servo-valve
    ),
    Machine(
        'south',
        (110.0, 1.3e9, 3.0e5, 0.5),
        drift=(0.0, -0.06, 0.0, 0.5),  # seals wear
        repair=(0.62, (0.0, 0.0, 0.08, -0.9)),  # new seals, fresh oil
    ),
    Machine(
        'east',
        (150.0, 0.8e9, 2.0e5, 0.4),
        effect=('backlash', 6e-5, [(0.30, 0.36), (0.80, 0.84)]),  # a pin that works loose
    ),
    Machine(
        'west',
        (120.0, 1.1e9, 2.6e5, 0.35),
        drift=(-0.05, 0.0, 0.0, 0.0),
        effect=('delay', 4e-3, [(0.50, 0.55)]),  # a filter that somebody forgot
    ),
)


def command(kind: str, seconds: float, rng: np.random.Generator) -> Array:
    """Return a sweep (free) or random motion (clamped) of 2 mm, from rest [m]."""
    n = round(seconds * RATE)
    t = np.arange(n) / RATE
    if kind == 'free':
        last = rng.uniform(7.0, 9.0)
        return 2e-3 * np.sin(np.pi * (last / seconds) * t**2)
    sos = signal.butter(2, [0.3, rng.uniform(5.0, 8.0)], 'bandpass', fs=RATE, output='sos')
    shaped = signal.sosfilt(sos, rng.standard_normal(n)) * np.minimum(1.0, t)
    return np.asarray(2e-3 * shaped / np.abs(shaped).max())


def measured(
    u: Array, theta: Array, k: float, effect: tuple[str, float] | None, rng: np.random.Generator
) -> Array:
    """Return what the sensor shows of a held command (n,) [m]."""
    b1, n0, a2, a3 = theta
    den = [k + a2, a3 * k + b1 * (k + a2), b1 * a3 * k + n0]
    num, den_z, _ = signal.cont2discrete(([n0], den), 1.0 / (RATE * _FINE), 'zoh')
    held = np.repeat(u, _FINE)
    kind, size = effect or ('', 0.0)
    if kind == 'delay':
        late = round(size * RATE * _FINE)
        held = np.concatenate([np.zeros(late), held[: len(held) - late]])
    x = signal.lfilter(num.ravel(), den_z, held)
    if kind == 'backlash':
        x = _play(x, size)
    return np.asarray(x[::_FINE] + NOISE * rng.standard_normal(len(u)))


def _play(x: Array, half: float) -> Array:
    y, at = np.empty_like(x), 0.0
    for i, value in enumerate(x):
        at = min(max(at, value - half), value + half)
        y[i] = at
    return y
