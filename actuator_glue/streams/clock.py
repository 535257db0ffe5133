"""The sender's clock in the receiver's time: offset and skew from the least delayed messages.

The delay of a message is never negative, so that the smallest difference of both clocks in each
second is the most accurate; a straight line through these minima of the last two minutes has the
offset as its height and the skew as its slope (as NTP's clock filter and Moon, Skelly, Towsley
1999 have it).
"""

from __future__ import annotations

from collections import deque

import numpy as np

# Length of a stretch that gives one difference [s], and how many are kept.
STRETCH = 1.0
KEPT = 120
# Fewest differences that give a slope.
LEAST = 5
# A difference this far off the line is another setting of a clock [s].
STEP = 0.05
# Stamps run this much faster or slower than the sender's clock at most, while the map improves.
SLEW = 1e-3
FIRST_SLEW = 0.05
# Stamps that prove off by more than this after a stream's first samples mean that a clock was set;
# by less, that the first samples were held up [s].
HELD_UP = 1.0
# Share of the time since the last stamped sample by which stamps may be set back at most.
GIVE_WAY = 0.5
# Late stretches in a row after which messages count as punctual again: the clock has been set.
_PATIENCE = 2


class ClockMap:
    """Maps the times of one stream; without any clock of its own.

    Attributes:
        steps: how often a clock was set.
    """

    def __init__(self) -> None:
        self.steps = 0
        self._origin: tuple[float, int] | None = None
        self._clear()
        self._shift = 0.0
        self._at = self._until = 0.0
        self._set = False

    def _clear(self) -> None:
        self._lowest: deque[tuple[float, float]] = deque(maxlen=KEPT)
        self._open: tuple[int, float, float] | None = None
        self._line = (0.0, 0.0, 0.0)
        self._odd = 0
        self._known = False

    def update(self, sender: float, arrival_ns: int) -> None:
        """Take one message.

        Args:
            sender: time of its last sample by the sender's clock [s].
            arrival_ns: when it came [ns].
        """
        if self._origin is None:
            self._origin = (sender, arrival_ns)
        time = sender - self._origin[0]
        delay = (arrival_ns - self._origin[1]) * 1e-9 - time
        stretch = int(time // STRETCH)
        if self._open is not None and self._open[0] != stretch:
            self._close(*self._open[1:])
            self._open = None
        if self._open is None or delay < self._open[2]:
            self._open = (stretch, time, delay)
        if not self._lowest and (not self._known or delay < self._line[1]):
            # The first second: the best so far.
            self._line, self._known = (time, delay, 0.0), True

    def stamp_ns(self, sender: float, until: float | None = None) -> int:
        """Return the receiver's time of a sample [ns]; ask in order.

        Stamps never go back, except where a clock was set.

        Args:
            sender: its time by the sender's clock [s].
            until: time of the last sample whose stamp follows from this one, as in a block with a
                single stamp; None where each sample is asked for.
        """
        assert self._origin is not None
        time = sender - self._origin[0]
        at, height, slope = self._line
        wanted = height + slope * (time - at)
        slew = SLEW if len(self._lowest) > 1 else FIRST_SLEW
        most = slew * max(time - self._at, 0.0)
        least = min(most, GIVE_WAY * max(time - self._until, 0.0))
        change = wanted - self._shift
        if abs(change) > (STEP if self._set else HELD_UP):
            self._shift = wanted
        else:
            self._shift += min(max(change, -least), most)
        self._set = False
        self._at = time
        self._until = time if until is None else until - self._origin[0]
        return self._origin[1] + round((time + self._shift) * 1e9)

    @property
    def offset(self) -> float:
        """Receiver's clock minus sender's, as of the last sample, shortest delay included [s]."""
        if self._origin is None:
            return float('nan')
        return self._origin[1] * 1e-9 - self._origin[0] + self._shift

    @property
    def skew(self) -> float:
        """How much faster the receiver's clock runs than the sender's [1]; NaN if not known."""
        return self._line[2] if len(self._lowest) >= LEAST else float('nan')

    @property
    def spread(self) -> float:
        """Spread of the shortest delays about the line [s]."""
        if len(self._lowest) < LEAST:
            return float('nan')
        return float(np.std(self._residuals()))

    def _residuals(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        times, delays = np.array(self._lowest).T
        at, height, slope = self._line
        return np.asarray(delays - height - slope * (times - at), dtype=np.float64)

    def _close(self, time: float, delay: float) -> None:
        """Take the smallest difference of a stretch."""
        if self._lowest:
            at, height, slope = self._line
            off = delay - height - slope * (time - at)
            if abs(off) > STEP:
                self._odd += 1
                # Impossibly early means another clock setting at once; late may be a delay.
                if off > 0.0 and self._odd < _PATIENCE:
                    return
                self.steps += 1
                self._set = True
                self._clear()
                self._known = True
            self._odd = 0
        self._lowest.append((time, delay))
        self._fit()

    def _fit(self) -> None:
        times, delays = np.array(self._lowest).T
        if len(times) < LEAST:
            lowest = int(np.argmin(delays))
            self._line = (float(times[lowest]), float(delays[lowest]), 0.0)
            return
        at = float(times.mean())
        weights = np.ones(len(times))
        for _ in range(4):
            # Stretches in which every message was held up count little.
            slope, height = np.polyfit(times - at, delays, 1, w=weights)
            off = delays - height - slope * (times - at)
            scale = 1.5 * float(np.median(np.abs(off))) + 1e-6
            weights = 1.0 / np.maximum(1.0, np.abs(off) / scale)
        self._line = (at, float(height), float(slope))
