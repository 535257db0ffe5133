"""When each sample of a bag was there: what is shown at a place was received by then."""

from __future__ import annotations

from array import array
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from actuator_glue.records import same_period

LONGEST_GAP = 1 << 22  # samples that a bag lacks and the page leaves empty, an hour at 1 kHz
_CATCH_UP = 60.0  # s, within which a recorder that stood still is on time again


class Timeline:
    """Places of a bag's blocks, and of any time at which something was received.

    Places count samples since the first one. A pause takes as many places as it lasted; one that
    is longer than LONGEST_GAP takes one.
    """

    def __init__(self) -> None:
        self.period = 0.0
        self.samples = 0  # measured in all
        self.passed = 0  # of them, those before the period changed
        self.places = 0  # of the samples of one period, gaps and pauses included
        self._most = 0
        self._next = 0
        self._shift = 0
        self._stops = array('q')
        self._times = array('q')
        self._streams = array('q')
        self._known: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None

    @property
    def capacity(self) -> int:
        """Places that hold all samples of any one period."""
        return max(self._most, self.places)

    def add(self, index: int, count: int, period: float, received: int) -> int:
        """Take a block and return the place of its first sample.

        Args:
            index: running index of the first sample.
            count: samples.
            period: between them [s].
            received: when the recorder took the block [ns].
        """
        if not same_period(period, self.period):
            self._most, self.passed = self.capacity, self.samples
            self.period, self.places, self._shift, self._next = period, 0, -index, index
            for column in (self._stops, self._times, self._streams):
                del column[:]
        elif index < self._next or index - self._next > LONGEST_GAP:
            begun = received - round(1e9 * count * period)
            pause = round((begun - self._times[-1]) * 1e-9 / period)
            self._shift = self.places + (pause if 0 < pause <= LONGEST_GAP else 1) - index
            self._streams.append(len(self._times))
        self._next = index + count
        self.samples += count
        self.places = self._next + self._shift
        self._stops.append(self.places)
        self._times.append(received)
        self._known = None
        return index + self._shift

    def place(self, received: int) -> int:
        """Return the place that was reached at a time at which something was received [ns].

        Times count, not the order in a file: a recorder that stood still, or a bag put together
        from several, holds samples behind what was said of them.
        """
        if not self._times:
            return 0
        if self._known is None:
            self._known = np.array(self._stops), self._on_time()
        stops, times = self._known
        last = int(np.searchsorted(times, received, side='right')) - 1
        if last < 0:
            return 0
        since = min((received - int(times[last])) * 1e-9 / self.period, LONGEST_GAP)
        reached = int(stops[last]) + int(since)
        return min(reached, int(stops[last + 1])) if last + 1 < len(stops) else reached

    def _on_time(self) -> NDArray[np.int64]:
        """Return when each block would have been received by a recorder that never stood still.

        A later block that came in time says that those before it were there by then.
        """
        stops, times = np.array(self._stops), np.array(self._times)
        edges = [0, *self._streams, len(times)]
        for begin, end in pairwise(edges):
            sent = np.rint(stops[begin:end] * (1e9 * self.period)).astype(np.int64)
            times[begin:end] = sent + _least_soon(times[begin:end] - sent, sent)
        return _least_from(times)


def _least_soon(late: NDArray[np.int64], sent: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the least of each value and those that were sent soon after it, shape (n,)."""
    spell = np.arange(sent[0], sent[-1] + 1, round(1e9 * _CATCH_UP))
    starts = [*np.searchsorted(sent, spell).tolist(), len(sent), len(sent)]
    found = np.empty_like(late)
    for begin, middle, end in zip(starts, starts[1:], starts[2:], strict=False):
        found[begin:middle] = _least_from(late[begin:end])[: middle - begin]
    return found


def _least_from(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the least of each value and all behind it, shape (n,)."""
    least: NDArray[np.int64] = np.minimum.accumulate(values[::-1])[::-1]
    return least
