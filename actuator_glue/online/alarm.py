"""When the model lacks something, or has begun to, and whether another one was any better."""

from __future__ import annotations

from collections import deque

import numpy as np


class CoverageAlarm:
    """Raised when the bands of kind 'noise' cover far less than they say.

    That band holds the parameters' spread and the sensor's noise: all there is if the model lacks
    nothing. Errors 1.5 times the noise bring its 95 % band down to 80 %.

    Args:
        limit: mean coverage below which the alarm is raised.
        count: successive bands the mean is taken over.
    """

    def __init__(self, limit: float = 0.8, count: int = 5) -> None:
        self.limit = limit
        self._seen: deque[float] = deque(maxlen=count)
        self._raised = False

    @property
    def coverage(self) -> float:
        """Mean coverage of the last bands; NaN before there are enough."""
        full = len(self._seen) == self._seen.maxlen
        return float(np.mean(self._seen)) if full else float('nan')

    def update(self, coverage: float) -> bool:
        """Take the coverage of one more band; return whether the alarm is raised by it.

        It is raised once; coverage at or above the limit arms it again.
        """
        self._seen.append(coverage)
        mean = self.coverage
        if np.isnan(mean):
            return False
        was, self._raised = self._raised, mean < self.limit
        return self._raised and not was

    def reset(self) -> None:
        """Begin anew: the model or the test has changed."""
        self._seen.clear()
        self._raised = False


class SwapWatch:
    """Whether forecasts have become worse since the model was swapped.

    Args:
        count: bands before and after the swap that are compared.
        settle: bands after the swap that are still those of the old model, or of a new one that
            has seen little.
        worse: ratio of the medians of their errors from which on they count as worse.
    """

    def __init__(self, count: int = 8, settle: int = 4, worse: float = 1.1) -> None:
        self.worse, self._settle = worse, settle
        self._before: deque[float] = deque(maxlen=count)
        self._after: deque[float] = deque(maxlen=count)
        self._wait = -1  # bands to be passed over; negative without a swap

    def swapped(self) -> None:
        """Begin to compare; without enough bands before the swap there is nothing to say."""
        self._after.clear()
        self._wait = self._settle if len(self._before) == self._before.maxlen else -1

    def reset(self) -> None:
        """Begin anew: the test has changed."""
        self._before.clear()
        self._after.clear()
        self._wait = -1

    def update(self, error: float) -> float:
        """Take the rms error of one more band [m].

        Returns:
            The ratio of errors after to before where the swap has made them worse, else 0; it is
            told once.
        """
        if not np.isfinite(error):
            return 0.0
        if self._wait < 0:
            self._before.append(error)
            return 0.0
        if self._wait > 0:
            self._wait -= 1
            return 0.0
        self._after.append(error)
        if len(self._after) < (self._after.maxlen or 1):
            return 0.0
        before = float(np.median(self._before))
        ratio = float(np.median(self._after)) / before if before > 0.0 else 0.0
        self._before, self._wait = deque(self._after, self._after.maxlen), -1
        self._after.clear()
        return ratio if ratio > self.worse else 0.0
