"""What times of samples tell where nothing counts them: their numbers, and which are missing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from actuator_glue.records import Array

# Share of what a time lies off its number by which the next ones are expected to.
_FOLLOW = 0.05
# Arrival in order: times further apart than this are a gap, not jitter [s].
_JITTER = 0.1


class NumbersByTime:
    """Numbers samples by their times where nothing else counts them.

    Times need not be multiples of the period: where they lie between them is followed, so that
    neither their phase nor a drift within the clocks' tolerance makes two samples one.
    """

    def __init__(self) -> None:
        self._phase: float | None = None

    def of(self, times: Array) -> NDArray[np.int64]:
        """Return the number of each sample, shape (n,); `times` are in sample periods."""
        found = np.empty(len(times), dtype=np.int64)
        phase = self._phase
        for i, time in enumerate(times.tolist()):
            if phase is None:
                phase = time - round(time)
            found[i] = number = round(time - phase)
            phase += _FOLLOW * (time - phase - number)
        self._phase = phase
        return found


class Jumps:
    """Finds where times of samples that arrive in order jump ahead, by whatever messages.

    Times may stand still for several samples, as those in whole seconds do. A jump is one after a
    step that was none: where all steps are as long, the rate is another one, told as such.

    Args:
        rate: sample rate [Hz].
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._time, self._samples, self._steady = np.inf, 0, False

    def found(self, times: Array) -> list[tuple[int, int]]:
        """Return before which of the samples, shape (n,) [s], some are missing, and how many."""
        gaps = []
        for at, time in enumerate(times.tolist()):
            if time == self._time:
                self._samples += 1
                continue
            missing, ahead = 0, time > self._time
            if ahead:
                missing = round((time - self._time) * self._rate) - self._samples
            jump = max(1, _JITTER * self._rate) <= missing <= 3600 * self._rate
            if jump and self._steady:
                gaps.append((at, missing))
            self._time, self._samples, self._steady = time, 1, ahead and not jump
        return gaps
