"""Commands that a preview tells before they are acted on, kept for forecasts."""

from __future__ import annotations

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.online.stream import Preview
from actuator_glue.records import MAX_DISPLACEMENT, Array, same_period


class Ahead:
    """Commands that are known before they are acted on; bounded."""

    def __init__(self, limit: int = 1_000_000) -> None:
        self._limit = limit
        self._start = 0
        self._period = 0.0
        self._command: Array = np.empty(0)

    def take(self, preview: Preview) -> None:
        """Join a preview to what is known; one that does not join replaces it.

        Raises:
            InputError: NaN, absurd values, or far too many samples.
        """
        command = np.asarray(preview.command, dtype=np.float64)
        where = f'command preview at sample {preview.index}'
        if not len(command) or len(command) > self._limit:
            raise InputError(f'{where}: {len(command)} samples; 1 to {self._limit} can be used')
        if not np.abs(command).max() <= MAX_DISPLACEMENT:
            raise InputError(f'{where}: NaN, or a displacement beyond {MAX_DISPLACEMENT:g} m')
        stop = self._start + len(self._command)
        follows = self._start <= preview.index <= stop
        if follows and same_period(preview.period, self._period):
            command = np.concatenate([self._command[: preview.index - self._start], command])
            self._command = command[-self._limit :]
            self._start += len(command) - len(self._command)
        else:
            self._start, self._period, self._command = preview.index, preview.period, command

    def forget(self, index: int) -> None:
        """Forget commands before a sample."""
        gone = min(max(0, index - self._start), len(self._command))
        self._command = self._command[gone:]
        self._start += gone

    def between(self, start: int, stop: int, period: float) -> Array | None:
        """Return the commands of samples start:stop; None where not all of them are known."""
        if not same_period(period, self._period):
            return None
        if not self._start <= start <= stop <= self._start + len(self._command):
            return None
        return self._command[start - self._start : stop - self._start]
