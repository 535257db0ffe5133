"""Memory of the nodes while they run, and how fast it grows.

Counted is what belongs to a process alone and to no file (RssAnon): libraries that other processes
map as well come and go with those. A killed process and the one in its place are two; the slope is
the median of the slopes between all pairs of points of the same process (Sen 1968; Hirsch, Slack,
Smith 1982), which single steps and spikes hardly move.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from actuator_glue.records import Array

# A point is the median of so many seconds [s]: what allocators take and give back averages out.
STRETCH = 20.0
# A process is warm at this age [s].
WARM = 90.0


class Reading(NamedTuple):
    """Memory of one process at one time.

    Attributes:
        seconds: since the stream began.
        part: whose it is, e.g. `estimator` or `estimator worker`.
        process: its number.
        megabytes: of its own.
    """

    seconds: float
    part: str
    process: int
    megabytes: float


@dataclass(frozen=True, slots=True)
class Growth:
    """How fast one part grows, limits of 95 % included [MB/h]; memory at the end [MB]."""

    slope: float
    lower: float
    upper: float
    megabytes: float
    processes: int


def children(process: int) -> list[int]:
    """Return the children of a process."""
    with suppress(OSError):
        tasks = Path(f'/proc/{process}/task').iterdir()
        return [int(c) for task in tasks for c in (task / 'children').read_text().split()]
    return []


def computes(process: int) -> bool:
    """Return whether a process is a worker of ours."""
    with suppress(OSError):
        return b'spawn_main' in Path(f'/proc/{process}/cmdline').read_bytes()
    return False


def anonymous(process: int) -> float:
    """Return the memory of a process that is no file's [MB]; NaN where it cannot be read."""
    with suppress(OSError, ValueError, IndexError):
        status = Path(f'/proc/{process}/status').read_text()
        return int(status.partition('RssAnon:')[2].split(maxsplit=1)[0]) / 1024.0
    return math.nan


def read(seconds: float, nodes: Mapping[str, int]) -> list[Reading]:
    """Return the memory of nodes, by name and process, and that of their workers."""
    found = []
    for name, process in nodes.items():
        found.append(Reading(seconds, name, process, anonymous(process)))
        for child in filter(computes, children(process)):
            found.append(Reading(seconds, f'{name} worker', child, anonymous(child)))
    return [reading for reading in found if math.isfinite(reading.megabytes)]


def growth(readings: Sequence[Reading], warm: float) -> dict[str, Growth]:
    """Return the growth of each part of which there is enough to tell.

    Args:
        readings: in the order of time.
        warm: what is left out at the start of the run [s].
    """
    found = {}
    for part in dict.fromkeys(r.part for r in readings):
        processes: dict[int, list[Reading]] = {}
        for reading in readings:
            if reading.part == part:
                processes.setdefault(reading.process, []).append(reading)
        curves = [_curve(own, warm) for own in processes.values()]
        limits = _slope([c for c in curves if len(c) > 1])
        if limits is not None:
            last = next(r.megabytes for r in reversed(readings) if r.part == part)
            found[part] = Growth(*limits, megabytes=last, processes=len(processes))
    return found


def _curve(readings: Sequence[Reading], warm: float) -> Array:
    """Return medians of stretches of a warm process: rows of time [h] and memory [MB]."""
    begin = readings[0].seconds
    # What was there before the stream has no less to warm up.
    begin = max(warm, begin + WARM)
    stretches: dict[int, list[float]] = {}
    for reading in readings:
        if reading.seconds >= begin:
            stretches.setdefault(int(reading.seconds // STRETCH), []).append(reading.megabytes)
    rows = [(k * STRETCH / 3600.0, float(np.median(v))) for k, v in stretches.items()]
    return np.array(rows).reshape(-1, 2)


def _slope(curves: Iterable[Array]) -> tuple[float, float, float] | None:
    """Return the slope and its limits of 95 % [MB/h], or None of too little."""
    slopes, variance = [], 0.0
    for curve in curves:
        first, second = np.triu_indices(len(curve), 1)
        step = curve[second] - curve[first]
        slopes.append(step[:, 1] / step[:, 0])
        n = len(curve)
        variance += n * (n - 1) * (2 * n + 5) / 18.0
    ordered = np.sort(np.concatenate(slopes)) if slopes else np.empty(0)
    if len(ordered) < 20:
        return None
    # Of Kendall's statistic, whose ranks the limits are (Sen 1968).
    reach = 1.96 * math.sqrt(variance)
    low = max(round((len(ordered) - reach) / 2.0) - 1, 0)
    high = min(round((len(ordered) + reach) / 2.0), len(ordered) - 1)
    return float(np.median(ordered)), float(ordered[low]), float(ordered[high])
