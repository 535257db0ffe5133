"""Stability of a hybrid test over the draws of a posterior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, spearmanr

from actuator_glue.hybrid.linear_system import System, closed, held, series
from actuator_glue.hybrid.loop import Actuator, substructures
from actuator_glue.hybrid.margin import sampled_delay_margin
from actuator_glue.hybrid.partition import Partition
from actuator_glue.records import Array

Flags = NDArray[np.bool_]

_AT_ONCE = 64  # draws whose matrices are in memory together


@dataclass(frozen=True, slots=True)
class Share:
    """A probability estimated from draws, with its interval.

    Attributes:
        value: share of the draws.
        lower, upper: limits of the interval.
        level: of the interval.
        effective_draws: independent draws that these count for.
    """

    value: float
    lower: float
    upper: float
    level: float
    effective_draws: float


class Tracking(NamedTuple):
    """How each draw follows a sine: delay (m, f) [s], amplitude (m, f), bandwidth (m,) [Hz]."""

    delay: Array
    amplitude: Array
    bandwidth: Array


def loops(
    partition: Partition,
    specimen: Mapping[str, Array],
    actuators: System,
    compensator: System | None = None,
) -> System:
    """Return the open loop of each draw: substructures, compensator, actuator."""
    loop = substructures(partition, specimen)
    if compensator is not None:
        loop = series(loop, compensator)
    return series(loop, actuators)


def growth(loop: System, period: float, delay: Array) -> Array:
    """Return the real part of the rightmost characteristic root of the sampled loop, (m,) [1/s].

    ln |z| / T of the largest root z of the loop whose force is held over each sample and whose
    command comes `delay` later: positive where the test is unstable.

    Args:
        loop: continuous open loop with D = 0.
        period: sample period T [s].
        delay: of computation and of the actuator's command, (m,) [s].
    """
    out = np.empty(len(loop.D))
    for first in range(0, len(out), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        discrete = held(System(*(x[part] for x in loop)), period, delay[part])
        radius = np.abs(np.linalg.eigvals(closed(discrete))).max(axis=1)
        out[part] = np.log(radius) / period
    return out


def signed_margin(loop: System, period: float, delay: Array, unstable: Flags) -> Array:
    """Return the further delay that each draw can bear, (m,) [s].

    For an unstable draw it is negative: the smallest lead that brings a characteristic root to the
    stability limit.
    """
    later, sooner = sampled_delay_margin(loop, period, delay)
    return np.where(unstable, -sooner, later)


def share(hits: Flags, effective: float, level: float = 0.95) -> Share:
    """Return a share of draws with its Clopper-Pearson interval.

    Args:
        hits: whether each draw counts, (m,).
        effective: independent draws that they are worth; more than m count as m.
        level: of the interval, two-sided.
    """
    n = float(np.clip(effective, 1.0, len(hits)))
    value = float(np.mean(hits))
    x, tail = value * n, 0.5 * (1.0 - level)
    lower = 0.0 if x <= 0.0 else float(beta.ppf(tail, x, n - x + 1.0))
    upper = 1.0 if x >= n else float(beta.ppf(1.0 - tail, x + 1.0, n - x))
    return Share(value, lower, upper, level, n)


def tracking(found: Actuator, frequencies_hz: Sequence[float]) -> Tracking:
    """Return delay, amplitude and bandwidth (3 dB below static) of second-order actuators."""
    w = 2.0 * np.pi * np.asarray(frequencies_hz, dtype=np.float64)
    gain = found.system.response(np.broadcast_to(1j * w, (len(found.delay), len(w))))
    delay = -np.angle(gain) / w + found.delay[:, None]
    # |G|^2 = |G(0)|^2 / 2: (a0 - w^2)^2 + (a1 w)^2 = 2 a0^2, a quadratic in w^2.
    a0, a1 = -found.system.A[:, 1, 0], -found.system.A[:, 1, 1]
    half = a0 - 0.5 * a1**2
    bandwidth = np.sqrt(half + np.sqrt(half**2 + a0**2)) / (2.0 * np.pi)
    return Tracking(delay, np.abs(gain), bandwidth)


def sensitivity(values: Array, inputs: Mapping[str, Array]) -> dict[str, float]:
    """Return Spearman's rank correlation of values (m,) with each input that varies."""
    if len(values) < 3 or np.ptp(np.nan_to_num(values, posinf=0.0, neginf=0.0)) == 0.0:
        return {}
    return {
        name: float(spearmanr(values, column).statistic)
        for name, column in inputs.items()
        if np.ptp(column) > 0.0
    }
