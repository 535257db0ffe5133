"""Samples and events of a test, as many as fit: the oldest make room for the newest."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.float32]
ROWS = ('command', 'measured', 'lower', 'median', 'upper')
_EVENTS = 2000  # of a kind that are kept


@dataclass(frozen=True, slots=True)
class Curves:
    """Rows of `ROWS` at common times.

    Attributes:
        times: shape (n,) [s] since the test began.
        rows: shape (len(ROWS), n) [mm]; NaN where there is nothing.
    """

    times: NDArray[np.float64]
    rows: Samples


class History:
    """Rings of samples by their place in the test, and the last events of each kind.

    Memory is taken once. Places count samples since the test began; a stream that begins again
    goes on at the next place.

    Args:
        capacity: samples that are kept.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self.period = 0.0
        self.measured_to = 0  # place after the last measured sample
        self.version = 0
        self._ring = np.full((len(ROWS), capacity), np.nan, dtype=np.float32)
        self._front = 0  # place after the last one written, forecasts included
        self._shift = 0  # place of a running index
        self._next = 0  # running index that follows
        # As text, which takes a fifth of the objects' memory.
        self._events: dict[str, deque[tuple[int, bytes]]] = {}

    @property
    def oldest(self) -> int:
        """First place that is kept."""
        return max(self._front - self.capacity, 0)

    def add_samples(self, index: int, period: float, rows: Mapping[str, Any]) -> None:
        """Take measured samples [m] from a running index on."""
        if period != self.period:
            self._restart(index, period)
        elif index < self._next or index - self._next > self.capacity:
            self._shift = self.measured_to - index  # a new stream, or one long interrupted
        count = len(rows['measured'])
        self._put(index, {name: rows[name] for name in ('command', 'measured')})
        self._next = index + count
        self.measured_to = self._next + self._shift
        self.version += 1

    def add_band(self, index: int, rows: Mapping[str, Any]) -> None:
        """Take lower limit, median and upper limit [m] from a running index on."""
        if self.period and abs(index + self._shift - self.measured_to) < self.capacity:
            self._put(index, rows)
            self.version += 1

    def add_event(self, kind: str, content: Mapping[str, Any]) -> None:
        """Take an event that happens now; kept as long as samples are, and once while it lasts."""
        events = self._events.setdefault(kind, deque(maxlen=_EVENTS))
        text = json.dumps(content).encode()
        if events and events[-1][1] == text:
            return
        events.append((self.measured_to, text))
        while len(events) > 1 and events[1][0] <= self.oldest:
            events.popleft()
        self.version += 1

    def state(self, place: int) -> dict[str, Mapping[str, Any]]:
        """Return the last event of each kind before a place."""
        found: dict[str, Mapping[str, Any]] = {}
        for kind, events in self._events.items():
            last = next((text for at, text in reversed(events) if at <= place), None)
            if last is not None:
                found[kind] = json.loads(last)
        return found

    def curves(self, start: int, stop: int, points: int) -> Curves:
        """Return what is kept between two places, no more than so many points.

        Where samples are many, two points stand for a stretch: its least and its greatest value.
        A band keeps its outer limits there.
        """
        start, stop = max(start, self.oldest), min(stop, self._front)
        places = np.arange(start, max(stop, start))
        rows = self._ring[:, places % self.capacity]
        many = -(-len(places) // max(points // 2, 1))
        if many > 2:
            whole = len(places) // many * many
            places, rows = places[:whole:many], rows[:, :whole]
            places = np.column_stack([places, places + many // 2]).ravel()
            rows = _extremes(rows.reshape(len(ROWS), -1, many))
        return Curves(places * np.float64(self.period), rows)

    def _restart(self, index: int, period: float) -> None:
        self._ring[:] = np.nan
        self.period, self._shift = period, -index
        self._next = index
        self._front = self.measured_to = 0
        for kind, events in self._events.items():  # what was said last still holds
            self._events[kind] = deque([(0, events[-1][1])], maxlen=_EVENTS)

    def _put(self, index: int, rows: Mapping[str, Any]) -> None:
        start = index + self._shift
        count = min(len(values) for values in rows.values())
        skip = max(self.oldest - start, count - self.capacity, -start, 0)
        places = np.arange(start + skip, start + count)
        if not len(places):
            return
        stop = start + count
        if stop > self._front:
            new = np.arange(max(self._front, stop - self.capacity), stop)
            self._ring[:, new % self.capacity] = np.nan
            self._front = stop
        for name, values in rows.items():
            part = np.asarray(values[skip:count], dtype=np.float64) * 1e3
            self._ring[ROWS.index(name), places % self.capacity] = part


def _extremes(rows: Samples) -> Samples:
    """Return least and greatest value of stretches, shape (rows, stretches, samples), in pairs."""
    nothing = np.isnan(rows).all(axis=2)
    least = np.where(np.isnan(rows), np.inf, rows).min(axis=2)
    greatest = np.where(np.isnan(rows), -np.inf, rows).max(axis=2)
    least[nothing] = greatest[nothing] = np.nan
    lower, upper = ROWS.index('lower'), ROWS.index('upper')
    greatest[lower], least[upper] = least[lower], greatest[upper]
    pairs: Samples = np.stack([least, greatest], axis=2).reshape(len(ROWS), -1)
    return pairs
