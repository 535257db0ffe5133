"""Where the rows of numbers begin in delimited text, and what parts them."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import Any

from actuator_glue.errors import InputError
from actuator_glue.io.formats.delimited import DELIMITERS, delimiter_of, fields_of
from actuator_glue.io.signature import text_encoding
from actuator_glue.io.units import units_line

_LOOK = 300  # lines in which the samples must begin
_ROWS = 5  # rows of one shape that are samples


def text_layout(path: Path) -> tuple[dict[str, Any], list[int]]:
    """Return entries of a channel map for a text, and the positions of its columns of numbers.

    Raises:
        InputError: no text, or no rows of at least two numbers near its beginning.
    """
    with path.open(encoding=text_encoding(path), errors='replace') as file:
        lines = [line.rstrip('\r\n') for line in islice(file, _LOOK)]
    while lines and not lines[-1].strip():
        lines.pop()
    best: tuple[int, int, str | None, list[int]] | None = None
    for delimiter in (*DELIMITERS, None):
        rows = [_numbers(line, delimiter) for line in lines]
        for first, numbers in enumerate(rows):
            following = rows[first : first + _ROWS]
            if len(numbers) >= 2 and len(following) >= 2 and all(r == numbers for r in following):
                if best is None or len(numbers) > len(best[3]):
                    best = (first, -len(numbers), delimiter, numbers)
                break
    if best is None:
        raise InputError(f'{path}: no rows of at least two numbers in the first {_LOOK} lines')
    first, _, delimiter, numbers = best
    entries: dict[str, Any] = {'header_lines': first}
    above = [fields_of(line, delimiter) for line in lines[max(first - 2, 0) : first]]
    if len(above) == 2 and len(above[0]) >= 2 and units_line(above[1]):
        entries['header_lines'] = first - 1  # a line of units is found by itself
    if delimiter is not None and delimiter != delimiter_of(lines[first]):
        entries['delimiter'] = delimiter
    return entries, numbers


def _numbers(line: str, delimiter: str | None) -> list[int]:
    """Return the positions of the numbers in a line."""
    return [i for i, text in enumerate(fields_of(line, delimiter)) if _is_number(text)]


def _is_number(text: str) -> bool:
    try:
        float(text.replace(',', '.', 1))
    except ValueError:
        return False
    return True
