"""Numbers that change from window to window, over the whole test, in bounded memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

_MOST = 4096  # rows; where they are full every second one goes
_COLUMNS = 96  # that are kept; the numbers of a new one beyond are not


class TrendColumn(NamedTuple):
    """What a column of numbers is of.

    Attributes:
        kind: 'weight' of a structure, 'mean', 'sd' or 'prior' (1: little more than it) of a
            parameter.
        name: of the structure or parameter.
        unit: SI unit.
    """

    kind: str
    name: str
    unit: str = ''


class Trends:
    """Rows of numbers by the place at which they were known, sorted by it.

    A column that a row does not tell is NaN there.

    Args:
        most: rows that are kept: half of them, evenly chosen, where they are full.

    Attributes:
        version: counts what was added.
    """

    def __init__(self, most: int = _MOST) -> None:
        self.version = 0
        self._most = most
        self.clear()

    def clear(self) -> None:
        """Let go of everything."""
        self.version += 1
        self._count = 0
        self._places = np.zeros(self._most, dtype=np.int64)
        self._columns: dict[TrendColumn, NDArray[np.float32]] = {}

    def add(self, place: int, row: Mapping[TrendColumn, float]) -> None:
        """Take what became known at a place."""
        if self._count == self._most:
            self._thin()
        at = int(np.searchsorted(self._places[: self._count], place, side='right'))
        self._insert(self._places, at, place)
        for column in row:
            if column not in self._columns and len(self._columns) < _COLUMNS:
                self._columns[column] = np.full(self._most, np.nan, dtype=np.float32)
        for column, values in self._columns.items():
            self._insert(values, at, row.get(column, np.nan))
        self._count += 1
        self.version += 1

    def known(self, place: int) -> int:
        """Return how many rows were known at a place."""
        return int(np.searchsorted(self._places[: self._count], place, side='right'))

    def before(
        self, place: int, points: int
    ) -> tuple[NDArray[np.int64], dict[TrendColumn, NDArray[np.float32]]]:
        """Return what was known at a place, the last of it included, no more than so many rows.

        Args:
            place: up to which.
            points: rows at most, at least two.

        Returns:
            Places (n,), and the values of each column (n,).
        """
        count = self.known(place)
        step = max(-(-count // (points - 1)), 1)
        rows = (
            np.unique(np.append(np.arange(0, count, step), count - 1)) if count else np.arange(0)
        )
        return self._places[rows], {c: values[rows] for c, values in self._columns.items()}

    def since(self, place: int, column: TrendColumn, least: float = 0.0) -> int | None:
        """Return the place since which a column has been above a number without a break.

        Args:
            place: at which that is asked.
            column: which.
            least: what it is above; NaN is not.

        Returns:
            None where it was not at `place`.
        """
        count, values = self.known(place), self._columns.get(column)
        if values is None or not count:
            return None
        without = np.flatnonzero(~(values[:count] > least))
        first = int(without[-1]) + 1 if len(without) else 0
        return int(self._places[first]) if first < count else None

    def _insert(self, values: NDArray[Any], at: int, value: float) -> None:
        values[at + 1 : self._count + 1] = values[at : self._count].copy()
        values[at] = value

    def _thin(self) -> None:
        """Keep every second row, and with it the first."""
        kept = -(-self._count // 2)
        every: list[NDArray[Any]] = [self._places, *self._columns.values()]
        for values in every:
            values[:kept] = values[: self._count : 2].copy()
        for values in self._columns.values():
            values[kept:] = np.nan
        self._count = kept
