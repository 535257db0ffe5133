"""When the estimator's coverage breaks: the model lacks something, or has begun to."""

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
