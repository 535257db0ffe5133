"""A declared sample rate held against clocks: a column of times, stamps of messages, arrivals."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

# Further apart than this is no drift of a clock but another rate [1].
APART = 0.01
# Shortest time over which rates are compared [s]: less shows a clock's jitter, not its rate.
LEAST_SECONDS = 2.0
_LEAST_POINTS = 8
_LEAST_STEPS = 64
# More points add no information, and a day of samples has many.
_MOST_POINTS = 4096


def rate_by_clock(index: ArrayLike, time: ArrayLike, declared: float) -> float | None:
    """Return the sample rate that a clock tells, where it is not the declared one [Hz].

    The median of the slopes over a quarter of the points each (after Theil and Sen): neither a
    clock that is set once nor late stamps move it.

    Args:
        index: running index of samples, ascending, shape (n,).
        time: time of each by the clock, shape (n,) [s].
        declared: sample rate that is declared [Hz].

    Returns:
        None where the clock agrees within `APART`, or too little is known: fewer than eight
        samples, less than two seconds, or slopes that scatter as much as they are off. Infinity
        where the clock stands still or goes back.
    """
    samples, clock = np.asarray(index, dtype=np.float64), np.asarray(time, dtype=np.float64)
    step = max(1, len(samples) // _MOST_POINTS)
    samples, clock = samples[::step], clock[::step]
    if len(samples) < _LEAST_POINTS or not np.isfinite(clock).all():
        return None
    span = len(samples) // 4
    nominal = (samples[span:] - samples[:-span]) / declared
    passed = clock[span:] - clock[:-span]
    longest = max(float(samples[-1] - samples[0]) / declared, float(clock[-1] - clock[0]))
    if longest < LEAST_SECONDS or not nominal.min() > 0.0:
        return None
    pace = passed / nominal
    typical = float(np.median(pace))
    scatter = float(np.median(np.abs(pace - typical)))
    if abs(typical - 1.0) <= APART or scatter > 0.5 * abs(typical - 1.0):
        return None
    return declared / typical if typical > 0.0 else float('inf')


def rate_by_steps(time: ArrayLike, declared: float) -> float | None:
    """Return the sample rate that the steps of times tell, where nothing else counts samples [Hz].

    The mean of the steps next to their median: times may be rounded, and samples missing.

    Args:
        time: times of samples in any order, shape (n,) [s].
        declared: sample rate that is declared [Hz].

    Returns:
        None where the steps agree within `APART`, or there are fewer than 64.
    """
    steps = np.diff(np.unique(np.asarray(time, dtype=np.float64)))
    if len(steps) < _LEAST_STEPS:
        return None
    typical = float(np.median(steps))
    near = steps[np.abs(steps - typical) <= 0.5 * typical]
    found = 1.0 / float(near.mean())
    return None if abs(declared / found - 1.0) <= APART else found


def disagreement(declared: float, clocks: dict[str, float]) -> str:
    """Return what is said where clocks tell another sample rate than the declared one.

    Args:
        declared: sample rate that is declared [Hz].
        clocks: rate by each clock that tells another one [Hz], by the clock's name; not empty.
    """
    told = ' and '.join(
        f'{name} stands still' if rate == float('inf') else f'by {name} it is {rate:.4g} Hz'
        for name, rate in clocks.items()
    )
    return f'the sample rate is said to be {declared:.6g} Hz, but {told}'


class RateWatch:
    """Holds a stream's declared rate against a clock as samples come; without a clock of its own.

    Args:
        rate: declared sample rate [Hz].
        seconds: length of a stretch that is compared [s].
        patience: stretches in a row that must tell another rate before it is believed.

    Attributes:
        found: rate by the clock where it is another one [Hz], else None.
    """

    def __init__(self, rate: float, *, seconds: float = 3.0, patience: int = 1) -> None:
        self.found: float | None = None
        self._rate, self._seconds, self._patience = rate, seconds, patience
        self._odd = 0
        self.begin()

    def begin(self) -> None:
        """Begin a stretch anew: the numbering or the clock is another one from here on."""
        self._points: list[tuple[float, float]] = []

    def push(self, index: int, time: float) -> None:
        """Take the time of one sample.

        Args:
            index: its running index, lost samples counted.
            time: by the clock [s].
        """
        points = self._points
        if points and index <= points[-1][0]:
            return
        if len(points) == _MOST_POINTS:
            del points[1::2]
        points.append((float(index), time))
        first = points[0]
        nominal = (index - first[0]) / self._rate
        # By either clock: where the declared rate is far too low samples alone take for ever.
        if len(points) < _LEAST_POINTS or max(nominal, time - first[1]) < self._seconds:
            return
        indices, times = np.array(points).T
        found = rate_by_clock(indices, times, self._rate)
        self._odd = 0 if found is None else self._odd + 1
        if found is None or self._odd >= self._patience:
            self.found = found
        self.begin()
