"""Stability of a hybrid test over the draws of a posterior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from actuator_glue.hybrid.actuator import Actuator
from actuator_glue.hybrid.compensator import Compensator
from actuator_glue.hybrid.linear_system import System, crossings, series
from actuator_glue.hybrid.loop import substructures
from actuator_glue.hybrid.margin import sampled_delay_margin
from actuator_glue.hybrid.partition import Partition
from actuator_glue.records import Array

Flags = NDArray[np.bool_]
FEW = 3  # draws that a rank correlation needs


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
    compensator: Compensator,
) -> System:
    """Return the open loop of each draw: substructures, compensator, actuator."""
    return series(substructures(partition, specimen), compensator.applied(actuators))


def signed_margin(loop: System, period: float, delay: Array, unstable: Flags) -> Array:
    """Return the further delay that each draw can bear, (m,) [s].

    For an unstable draw it is negative: the smallest lead that brings a characteristic root to the
    stability limit. The command is held as well, which is half a sample more of delay.
    """
    later, sooner = sampled_delay_margin(loop, period, delay + 0.5 * period)
    # At the limit itself the two ways of sampling may disagree by a thousandth of a sample.
    sooner = np.minimum(sooner, np.where(later < 0.05 * period, 0.0, np.inf))
    return np.where(unstable, -sooner, np.where(sooner < 0.05 * period, 0.0, later))


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
    lower = 0.0 if x <= 0.0 else float(scipy.stats.beta.ppf(tail, x, n - x + 1.0))
    upper = 1.0 if x >= n else float(scipy.stats.beta.ppf(1.0 - tail, x + 1.0, n - x))
    return Share(value, lower, upper, level, n)


def tracking(found: Actuator, frequencies_hz: Sequence[float]) -> Tracking:
    """Return delay, amplitude and bandwidth (3 dB below static) of linear actuators.

    The delay is that of the phase with all its turns: one angle alone tells a lag beyond half a
    turn as a lead.
    """
    w = 2.0 * np.pi * np.asarray(frequencies_hz, dtype=np.float64)
    gain = found.system.response(np.broadcast_to(1j * w, (len(found.delay), len(w))))
    delay = -found.system.phase(w, gain) / w + found.delay[:, None]
    static = found.system.response(np.zeros((len(found.delay), 1), dtype=np.complex128)).real
    scaled = found.system._replace(C=found.system.C * np.sqrt(2.0) / np.abs(static))
    bandwidth = np.nanmin(crossings(scaled), axis=1) / (2.0 * np.pi)
    return Tracking(delay, np.abs(gain), bandwidth)


def sensitivity(values: Array, inputs: Mapping[str, Array]) -> dict[str, float]:
    """Return Spearman's rank correlation of values (m,) with each input that varies.

    None where values do not vary, or are fewer than `FEW`.
    """
    if len(values) < FEW or np.ptp(np.nan_to_num(values, posinf=0.0, neginf=0.0)) == 0.0:
        return {}
    return {
        name: float(scipy.stats.spearmanr(values, column).statistic)
        for name, column in inputs.items()
        if np.ptp(column) > 0.0
    }
