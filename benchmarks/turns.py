"""Tasks timed in turns, over all repeats and over those that had a whole core.

A processor of a shared machine may be one of two threads of a core: while the other serves
somebody else, everything here takes up to twice as long, for seconds at a time. A fixed loop
before and after each repeat tells which repeats those were.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median

# Of each repeat [s]. Vector units that were idle run at a third of their speed for about a
# millisecond, and what other tasks have pushed out of the caches is fetched again.
_WARM, _COUNTED = 0.005, 0.01

_LOOP = 20_000
# A loop this much slower than the fastest of its run shared its core: a neighbour costs 1.7 to 2
# times, frequency and what ran just before up to 1.4.
_WHOLE = 1.5


@dataclass(frozen=True, slots=True)
class Taken:
    """Processor time of one task.

    Attributes:
        median: over all repeats [s].
        whole: over the repeats that had a whole core [s]; None where fewer than three had.
    """

    median: float
    whole: float | None


def in_turns(tasks: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, Taken]:
    """Time tasks that take turns, so that a machine which slows down slows all of them.

    Args:
        tasks: what to time, by name.
        repeats: turns of each; in each a task is repeated, first to get warm, then for its time.
    """
    for task in tasks.values():
        task()
    taken: dict[str, list[tuple[float, float]]] = {name: [] for name in tasks}
    for _ in range(repeats):
        for name, task in tasks.items():
            before = _pace()
            _repeat(task, _WARM)
            seconds = _repeat(task, _COUNTED)
            taken[name].append((max(before, _pace()), seconds))
    limit = _WHOLE * min(pace for times in taken.values() for pace, _ in times)
    return {name: _summary(times, limit) for name, times in taken.items()}


def _summary(times: list[tuple[float, float]], limit: float) -> Taken:
    whole = [seconds for pace, seconds in times if pace <= limit]
    return Taken(
        median(seconds for _, seconds in times), median(whole) if len(whole) >= 3 else None
    )


def _repeat(task: Callable[[], object], seconds: float) -> float:
    """Do a task for so long at least; return the time of one [s]."""
    began, count = time.process_time(), 0
    while (taken := time.process_time() - began) < seconds or not count:
        task()
        count += 1
    return taken / count


def _pace() -> float:
    """Return the time of a fixed loop, the best of five [s]: not an interrupt, a busy core."""
    best = float('inf')
    for _ in range(5):
        began = time.perf_counter()
        for _ in range(_LOOP):
            pass
        best = min(best, time.perf_counter() - began)
    return best
