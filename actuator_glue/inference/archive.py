"""The archive Z of past states that the moves draw their directions from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.records import Array


@dataclass
class _Buffer:
    rows: Array
    filled: int


@dataclass(frozen=True, slots=True)
class Archive:
    """Append-only points; appending returns a new archive and never changes this one.

    Successive archives share one buffer that grows by doubling. Appending twice to the same
    archive (two runs branching from one state) copies, so that neither branch sees the other.
    """

    _buffer: _Buffer
    size: int

    @classmethod
    def of(cls, rows: Array) -> Archive:
        """Start an archive with a copy of points (m, p)."""
        return cls(_Buffer(np.array(rows, dtype=np.float64, order='C'), len(rows)), len(rows))

    @property
    def capacity_rows(self) -> Array:
        """The buffer, (>= size, p): only the first `size` rows belong to this archive."""
        return self._buffer.rows

    @property
    def rows(self) -> Array:
        """The points, (size, p)."""
        return self._buffer.rows[: self.size]

    @property
    def newest_half(self) -> Array:
        """The later half of the points: what came from the start fades."""
        return self._buffer.rows[self.size // 2 : self.size]

    def append(self, points: Array) -> Archive:
        """Return the archive with points (m, p) added."""
        end = self.size + len(points)
        buffer = self._buffer
        if buffer.filled != self.size or end > len(buffer.rows):
            rows = np.empty((max(2 * self.size, end), points.shape[1]))
            rows[: self.size] = self.rows
            buffer = _Buffer(rows, self.size)
        buffer.rows[self.size : end] = points
        buffer.filled = end
        return Archive(buffer, end)
