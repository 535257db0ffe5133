"""Sizes in the units that people say them in: um and mm, ms, kN; SI stays inside."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

# By SI unit: from which size on (SI) which unit is said, and how many of it are one SI unit.
_SAID: dict[str, tuple[tuple[float, str, float], ...]] = {
    'm': ((0.0, 'um', 1e6), (1e-3, 'mm', 1e3), (10.0, 'm', 1.0)),
    'm/s': ((0.0, 'um/s', 1e6), (1e-3, 'mm/s', 1e3)),
    's': ((0.0, 'ms', 1e3), (1.0, 's', 1.0)),
    'N': ((0.0, 'N', 1.0), (1e3, 'kN', 1e-3)),
    'N/m': ((0.0, 'N/m', 1.0), (1e3, 'kN/m', 1e-3)),
    'N/s': ((0.0, 'N/s', 1.0), (1e3, 'kN/s', 1e-3)),
    'N s/m': ((0.0, 'N s/m', 1.0), (1e3, 'kN s/m', 1e-3)),
    'N/(m s^2)': ((0.0, 'N/(m s^2)', 1.0), (1e6, 'kN/(mm s^2)', 1e-6)),
    'm/N': ((0.0, 'mm/kN', 1e6),),
    '1/N': ((0.0, '1/kN', 1e3),),
    '1/m': ((0.0, '1/m', 1.0), (1e3, '1/mm', 1e-3)),
    '1/m^2': ((0.0, '1/m^2', 1.0), (1e3, '1/mm^2', 1e-6)),
    '1': ((0.0, '', 1.0),),
}


_MOST_DIGITS = 8  # of a double, more would be noise of the arithmetic
_SYMBOLS = {
    'beta_1': '\u03b2\u2081',
    'alpha_1_beta_0': '\u03b1\u2081\u03b2\u2080',
    'alpha_2': '\u03b1\u2082',
    'alpha_3': '\u03b1\u2083',
}


def word(name: str) -> str:
    """Return what a parameter or a number is called where people read: no key of a program."""
    return _SYMBOLS.get(name, name.replace('_', ' '))


def percents(shares: Sequence[float]) -> list[int]:
    """Return shares of one whole in whole percent that add up as the shares do."""
    exact = 100.0 * np.asarray(shares, dtype=np.float64)
    low = np.floor(exact).astype(int)
    most = np.argsort(low - exact, kind='stable')
    low[most[: round(float(exact.sum())) - int(low.sum())]] += 1
    return [int(value) for value in low]


def said_in(unit: str, *values: ArrayLike) -> tuple[float, str]:
    """Return the factor from the SI unit to the unit in which sizes as these are said, and that.

    Args:
        unit: SI unit, as parameters have it.
        values: sizes [SI]; the largest decides. What is not finite decides nothing.
    """
    sizes = np.concatenate([np.abs(np.asarray(v, dtype=np.float64)).ravel() for v in values])
    largest = float(sizes[np.isfinite(sizes)].max(initial=0.0))
    rows = _SAID.get(unit, ((0.0, unit, 1.0),))
    name, factor = next((n, f) for least, n, f in reversed(rows) if largest >= least)
    return factor, name


def said(value: float, unit: str, digits: int = 3) -> str:
    """Return a size with its unit as people say it: '40 um' for 4e-05 m."""
    factor, name = said_in(unit, value)
    if not math.isfinite(value):
        return plain(value)
    return f'{plain(factor * value, digits)} {name}'.rstrip()


def plain(value: float, digits: int = 3) -> str:
    """Return a number with so many digits, without a power of ten where it can be read so."""
    if not math.isfinite(value):
        return 'not known'
    if value == 0.0 or not 1e-3 <= abs(value) < 1e6:
        return f'{value:.{digits}g}'
    decimals = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    text = f'{value:.{decimals}f}'
    return text.rstrip('0').rstrip('.') if '.' in text else text


def spread(mean: float, lower: float, upper: float, unit: str, digits: int = 4) -> str:
    """Return a size with its interval as people say it: '41 um (40.2 to 41.9)'.

    Where `digits` are too few for a narrow interval there are more: two of its width.
    """
    width = upper - lower
    if math.isfinite(mean) and 0.0 < width < abs(mean):
        digits = min(max(digits, math.floor(math.log10(abs(mean) / width)) + 2), _MOST_DIGITS)
    factor, name = said_in(unit, mean, lower, upper)
    low, high = (plain(factor * v, digits) for v in (lower, upper))
    return f'{plain(factor * mean, digits)} {name}'.rstrip() + f' ({low} to {high})'
