"""How numbers are written for people."""

from __future__ import annotations

import math
from collections.abc import Iterable

from studies.chen.published import SHAPING_FACTORS

SUPERSCRIPT = str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹')
MINUS = '−'
# Symbols and units of the library's BASE for running text and tables.
SYMBOLS = ('β₁', 'α₁β₀', 'α₂', 'α₃')
UNITS = ('1/s', 'N/(m s²)', 'N/m', '1/s')
# What posteriors are called, by their names in `study.Results`.
KINDS = {'sensor': 'sensor noise', 'matched': 'matched residual'}
BANDS = {
    'sensor': 'GLUE, sensor noise',
    'matched': 'GLUE, matched residual',
    'total': 'total predictive',
}


def num(value: float | None, digits: int = 4, scale: float = 1.0) -> str:
    """Return a number times a scale with so many significant digits, 1.26 × 10⁹ where it is long.

    Zero is '0', NaN or nothing '–', infinity 'not reached'.
    """
    if value is None or math.isnan(value):
        return '–'
    if math.isinf(value):
        return 'not reached'
    value = float(value) * scale
    if value == 0.0:
        return '0'
    power = math.floor(math.log10(abs(float(f'{value:.{digits - 1}e}'))))
    if -4 <= power < 6:
        text = f'{value:.{max(0, digits - 1 - power)}f}'
    else:
        text = f'{value / 10.0**power:.{digits - 1}f} × 10' + str(power).translate(SUPERSCRIPT)
    return text.replace('-', MINUS)


def percent(share: float | None, digits: int = 1, *, sign: bool = False) -> str:
    """Return a share as per cent; '–' for NaN or nothing."""
    if share is None or math.isnan(share):
        return '–'
    return f'{100 * share:{"+" if sign else ""}.{digits}f}\xa0%'.replace('-', MINUS)


def power_of_two(value: float) -> str:
    """Return 256 as 2⁸."""
    return '2' + str(round(math.log2(value))).translate(SUPERSCRIPT)


def shaping_factor(value: float) -> str:
    """Return 256 as 2⁸ (G₆)."""
    index = '₀₁₂₃₄₅₆₇₈'[SHAPING_FACTORS.index(value) + 1]
    return f'{power_of_two(value)}\xa0(G{index})'


def named_parameters() -> list[str]:
    """Return symbol and unit of each parameter."""
    return [f'{s} [{u}]' for s, u in zip(SYMBOLS, UNITS, strict=True)]


def listed(items: Iterable[object]) -> str:
    """Return 'a, b and c'; 'none' of nothing."""
    words = [f'{i:g}' if isinstance(i, float) else str(i) for i in items]
    return ' and '.join(filter(None, (', '.join(words[:-1]), words[-1]))) if words else 'none'
