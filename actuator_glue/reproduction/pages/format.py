"""How numbers are written for people."""

from __future__ import annotations

import math

SUPERSCRIPT = str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹')
MINUS = '−'
# Symbols of model.parameters.BASE for running text and tables.
SYMBOLS = ('β₁', 'α₁β₀', 'α₂', 'α₃')
UNITS = ('1/s', 'N/(m s²)', 'N/m', '1/s')


def num(value: float, digits: int = 4) -> str:
    """Return a number with so many significant digits, as 1.26 × 10⁹ where it is long.

    Zero, NaN and infinity are '0', '–' and 'not reached'.
    """
    if math.isnan(value):
        return '–'
    if math.isinf(value):
        return 'not reached'
    if value == 0.0:
        return '0'
    power = math.floor(math.log10(abs(float(f'{value:.{digits - 1}e}'))))
    if -4 <= power < 6:
        text = f'{value:.{max(0, digits - 1 - power)}f}'
    else:
        text = f'{value / 10.0**power:.{digits - 1}f} × 10' + str(power).translate(SUPERSCRIPT)
    return text.replace('-', MINUS)


def percent(share: float, digits: int = 1, *, sign: bool = False) -> str:
    """Return a share as per cent; '–' for NaN."""
    if math.isnan(share):
        return '–'
    return f'{100 * share:{"+" if sign else ""}.{digits}f}\xa0%'.replace('-', MINUS)


def power_of_two(value: float) -> str:
    """Return 256 as 2⁸."""
    return '2' + str(round(math.log2(value))).translate(SUPERSCRIPT)
