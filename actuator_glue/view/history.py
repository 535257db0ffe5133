"""Samples, trends and events of a test in bounded memory."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.records import same_period
from actuator_glue.view.logbook import Logbook
from actuator_glue.view.trends import Trends

Samples = NDArray[np.float32]
# What is kept: motion and band in mm, the force in kN.
_KEPT = ('command', 'measured', 'force', 'lower', 'median', 'upper')
_SCALE = {'command': 1e3, 'measured': 1e3, 'force': 1e-3}
_BAND = slice(_KEPT.index('lower'), _KEPT.index('upper') + 1)
# The same and what is derived: command minus measured [mm], differences to the median [um].
ROWS = (*_KEPT, 'error', 'residual', 'residual_lower', 'residual_upper')
_EVENTS = 2000  # of a kind that are kept of a live system


@dataclass(frozen=True, slots=True)
class Curves:
    """Rows of `ROWS` at common times.

    Attributes:
        times: shape (n,) [s] since the test began.
        rows: shape (len(ROWS), n); NaN where there is nothing.
    """

    times: NDArray[np.float64]
    rows: Samples


class History:
    """Rings of samples by their place in the test, trends, and the last events of each kind.

    Memory is taken once: the newest samples replace the oldest, trends of the whole test get
    coarser. Places count samples since the test began; a stream that begins again
    goes on at the next place, or where a bag says that it did. What is said now belongs to the
    place that is measured, or to the place at which a bag received it.

    Args:
        capacity: samples that are kept.
        events: how many of a kind are kept; None for all.

    Attributes:
        trends: numbers of each window.
        log: what happened.
    """

    def __init__(self, capacity: int, events: int | None = _EVENTS) -> None:
        self.capacity = capacity
        self.period = 0.0
        self.measured_to = 0  # place after the last measured sample
        self.known_to = 0  # place of the last sample, or of what was said after it
        self.version = 0
        self.trends = Trends()
        self.log = Logbook()
        self._most = events
        self._ring = np.full((len(_KEPT), capacity), np.nan, dtype=np.float32)
        self._since = np.zeros(capacity, dtype=np.int32)  # place at which a band was known
        self._front = 0  # place after the last one written, forecasts included
        self._shift = 0  # place of a running index
        self._next = 0  # running index that follows
        # As text, which takes a fifth of the objects' memory.
        self._events: dict[tuple[str, str], deque[tuple[int, bytes]]] = {}

    @property
    def oldest(self) -> int:
        """First place that is kept."""
        return max(self._front - self.capacity, 0)

    def add_samples(
        self, index: int, period: float, rows: Mapping[str, Any], place: int | None = None
    ) -> None:
        """Take measured samples [m, N] from a running index on; `place` is that of the first.

        A force that there is none of may be empty.
        """
        if not same_period(period, self.period):
            self._restart(index, period, told=place is None)
        elif index < self._next or index - self._next > self.capacity:
            self._shift = self.measured_to - index  # a new stream, or one long interrupted
        if place is not None:
            self._shift = place - index
        count = len(rows['measured'])
        places = self._room(index, count)
        for row, name in enumerate(_KEPT[: _BAND.start]):
            values = np.asarray(rows.get(name, ()), dtype=np.float64)
            if len(values) == count:
                kept = _SCALE[name] * values[count - len(places) :]
                self._ring[row, places % self.capacity] = kept
        self._next = index + count
        self.measured_to = self._next + self._shift
        self.known_to = max(self.known_to, self.measured_to)
        self.version += 1

    def add_band(
        self, index: int, rows: Mapping[str, Any], place: int | None = None, *, again: bool = False
    ) -> None:
        """Take lower limit, median and upper limit [m] from a running index on.

        Args:
            index: of the first sample.
            rows: what is taken.
            place: at which it was known.
            again: it came before, and comes now with its score: the first limits stay.
        """
        if self.period and abs(index + self._shift - self.measured_to) < self.capacity:
            limits = np.array([rows[name] for name in _KEPT[_BAND]], dtype=np.float64)
            at = self._room(index, limits.shape[1]) % self.capacity
            limits = 1e3 * limits[:, limits.shape[1] - len(at) :]
            if again:
                free = np.isnan(self._ring[_BAND.start, at])
                at, limits = at[free], limits[:, free]
            self._ring[_BAND, at] = limits
            self._since[at] = self.measured_to if place is None else place
            self.version += 1

    def add_event(
        self, kind: str, content: Mapping[str, Any], place: int | None = None, *, of: str = ''
    ) -> None:
        """Take an event of a kind, kept as long as samples are, and once while it lasts.

        Args:
            kind: what it is.
            content: what JSON can hold.
            place: at which it was known; None for now.
            of: whose it is, where several have events of a kind: each has its last one.
        """
        events = self._events.setdefault((kind, of), deque(maxlen=self._most))
        text = json.dumps(content).encode()
        place = self.measured_to if place is None else place
        self.known_to = max(self.known_to, place)
        # Before events that became known later, though they came before.
        at = bisect_right(events, place, key=itemgetter(0))
        if at and events[at - 1][1] == text:
            return
        if len(events) == events.maxlen:
            events.popleft()
            at = max(at - 1, 0)
        events.insert(at, (place, text))
        while len(events) > 1 and events[1][0] <= self.oldest:
            events.popleft()
        self.version += 1

    def state(self, place: int) -> dict[str, Any]:
        """Return the last event of each kind before a place; by whose it is, where several are.

        `at` in each is when it became known [s].
        """
        found: dict[str, Any] = {}
        for (kind, of), events in self._events.items():
            last = next((event for event in reversed(events) if event[0] <= place), None)
            if last is None:
                continue
            content = json.loads(last[1]) | {'at': last[0] * self.period}
            if of:
                found.setdefault(kind, {})[of] = content
            else:
                found[kind] = content
        return found

    def curves(self, start: int, stop: int, points: int) -> Curves:
        """Return what is kept between two places, no more than so many points.

        Where samples are many, two points stand for a stretch: its least and its greatest value.
        A band keeps its outer limits there. A band that became known after `stop` is not there.
        """
        known = stop
        start, stop = max(start, self.oldest), min(stop, self._front)
        places = np.arange(start, max(stop, start))
        rows = self._ring[:, places % self.capacity]
        rows[_BAND, self._since[places % self.capacity] > known] = np.nan
        rows = _with_errors(rows)
        many = -(-len(places) // max(points // 2, 1))
        if many > 2:
            whole = len(places) // many * many
            places, rows = places[:whole:many], rows[:, :whole]
            places = np.column_stack([places, places + many // 2]).ravel()
            rows = _extremes(rows.reshape(len(ROWS), -1, many))
        return Curves(places * np.float64(self.period), rows)

    def _restart(self, index: int, period: float, *, told: bool) -> None:
        """Begin anew; what was said last still holds, and a bag's events have their places."""
        self._ring[:] = np.nan
        self._since[:] = 0
        self.period, self._shift = period, -index
        self._next = index
        self._front = self.measured_to = 0
        for events in self._events.values() if told else ():
            last = events[-1][1]
            events.clear()
            events.append((0, last))
        if told:
            self.trends.clear()
            self.log.clear()
        self.known_to = max((events[-1][0] for events in self._events.values()), default=0)

    def _room(self, index: int, count: int) -> NDArray[np.intp]:
        """Make room for samples from a running index on; return the places of the last of them."""
        start = index + self._shift
        stop = start + count
        if stop > self._front:
            new = np.arange(max(self._front, stop - self.capacity), stop)
            self._ring[:, new % self.capacity] = np.nan
            self._since[new % self.capacity] = 0
            self._front = stop
        return np.arange(max(start, self.oldest, 0), stop)


def _with_errors(rows: Samples) -> Samples:
    """Return rows of `ROWS` from those that are kept."""
    command, measured, _, lower, median, upper = rows
    about = [1e3 * (of - median) for of in (measured, lower, upper)]
    return np.vstack([rows, command - measured, *about])


def _extremes(rows: Samples) -> Samples:
    """Return least and greatest value of stretches, shape (rows, stretches, samples), in pairs."""
    nothing = np.isnan(rows).all(axis=2)
    least = np.where(np.isnan(rows), np.inf, rows).min(axis=2)
    greatest = np.where(np.isnan(rows), -np.inf, rows).max(axis=2)
    least[nothing] = greatest[nothing] = np.nan
    for of in ('', 'residual_'):
        lower, upper = ROWS.index(f'{of}lower'), ROWS.index(f'{of}upper')
        greatest[lower], least[upper] = least[lower], greatest[upper]
    pairs: Samples = np.stack([least, greatest], axis=2).reshape(len(ROWS), -1)
    return pairs
