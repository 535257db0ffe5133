"""The archive Z of past states that the moves draw their directions from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator_glue.jit import njit
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

    def append(self, points: Array) -> Archive:
        """Return the archive with points (m, p) added."""
        wide = self.with_room(len(points))
        wide.capacity_rows[self.size : self.size + len(points)] = points
        return wide.grown(self.size + len(points))

    def with_room(self, count: int) -> Archive:
        """Return the same archive, its buffer free for `count` more points and its own to fill."""
        end = self.size + count
        if self._buffer.filled == self.size and end <= len(self._buffer.rows):
            return self
        rows = np.empty((max(2 * self.size, end), self._buffer.rows.shape[1]))
        rows[: self.size] = self.rows
        return Archive(_Buffer(rows, self.size), self.size)

    def grown(self, size: int) -> Archive:
        """Return the archive of the buffer's first `size` rows, which the caller has filled."""
        if size == self.size:
            return self
        self._buffer.filled = size
        return Archive(self._buffer, size)


@njit
def newest(rows: Array, size: int) -> Array:
    """Return the first `size` rows but the oldest quarter: points of the start fade out."""
    return rows[size // 4 : size]
