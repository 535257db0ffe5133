"""Quantile bands of simulated responses, one draw of the parameters per row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.records import Array

# Quantiles sort a copy of the draws; columns are taken in blocks so that a whole test at 1 kHz
# does not need its copy in memory.
COLUMNS_AT_ONCE = 512


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Band:
    """Central bands around a median, one row per level.

    Attributes:
        levels: nominal share of the distribution inside each band, shape (L,), in (0, 1).
        lower: lower limits, shape (L, n), in the unit of the draws.
        median: median, shape (n,).
        upper: upper limits, shape (L, n).
    """

    levels: Array
    lower: Array
    median: Array
    upper: Array

    def __repr__(self) -> str:
        levels = ', '.join(f'{level:g}' for level in self.levels)
        return f'Band(levels {levels}; {self.median.size} samples)'

    def __len__(self) -> int:
        return len(self.median)

    def at(self, level: float) -> tuple[Array, Array]:
        """Return lower and upper limit of one level, each of shape (n,).

        Raises:
            InputError: the band has no such level.
        """
        found = np.flatnonzero(np.isclose(self.levels, level, rtol=0.0, atol=1e-9))
        if not found.size:
            raise InputError(f'band has levels {self.levels.tolist()}, not {level:g}')
        return self.lower[found[0]], self.upper[found[0]]

    def slice(self, start: int, stop: int) -> Band:
        """Return samples start:stop."""
        part = slice(start, stop)
        return Band(self.levels, self.lower[:, part], self.median[part], self.upper[:, part])


def check_levels(levels: ArrayLike) -> Array:
    """Return band levels as an array of shape (L,).

    Raises:
        InputError: no level, or one that is not between 0 and 1.
    """
    checked = np.atleast_1d(np.asarray(levels, dtype=np.float64))
    if not checked.size:
        raise InputError('no band level is given; give one between 0 and 1, as 0.95')
    if checked.ndim != 1 or not ((checked > 0) & (checked < 1)).all():
        raise InputError(f'band levels must lie between 0 and 1, got {levels!r}')
    return checked


def check_draws(draws: Array) -> Array:
    """Return draws of shape (m, n).

    Raises:
        InputError: fewer than two draws, or values that are not finite.
    """
    draws = np.asarray(draws, dtype=np.float64)
    if draws.ndim != 2 or len(draws) < 2:
        raise InputError(f'bands need at least two draws as rows (m, n), got shape {draws.shape}')
    if not np.isfinite(draws).all():
        row = int((~np.isfinite(draws)).any(axis=1).argmax())
        raise InputError(
            f'simulated draw {row} is not finite; drop diverging draws before taking a band'
        )
    return draws


def _weibull(columns: Array, wanted: Array) -> Array:
    """Quantiles (q, n) of columns (n, m), as np.quantile's method 'weibull' defines them.

    Sorting every column is vector code; numpy's selection of a few order statistics is not.
    """
    m = columns.shape[1]
    ordered = np.sort(columns, axis=1)
    place = np.clip(wanted * (m + 1.0) - 1.0, 0.0, m - 1.0)
    below = np.minimum(place.astype(np.intp), m - 2)
    low, high = ordered[:, below], ordered[:, below + 1]
    return np.asarray(low + (high - low) * (place - below)).T


def band(draws: Array, levels: Sequence[float] | Array = (0.95,)) -> Band:
    """Return central quantile bands of draws (m, n), column by column.

    The quantile of level q is the order statistic at q (m + 1) (Weibull's
    plotting position), interpolated: the band then covers a further draw from the same
    distribution with exactly its level, also for few draws (up to (m - 1)/(m + 1)).

    Args:
        draws: one simulated response per row, shape (m, n), any unit.
        levels: nominal share inside each band, shape (L,).

    Raises:
        InputError: see `check_draws`, `check_levels`.
    """
    draws = check_draws(draws)
    levels = check_levels(levels)
    wanted = np.concatenate([(1.0 - levels) / 2.0, [0.5], (1.0 + levels) / 2.0])
    quantiles = np.empty((len(wanted), draws.shape[1]))
    for start in range(0, draws.shape[1], COLUMNS_AT_ONCE):
        part = slice(start, start + COLUMNS_AT_ONCE)
        quantiles[:, part] = _weibull(np.ascontiguousarray(draws[:, part].T), wanted)
    count = len(levels)
    return Band(levels, quantiles[:count], quantiles[count], quantiles[count + 1 :])
