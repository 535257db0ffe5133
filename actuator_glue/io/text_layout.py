"""Where the rows of numbers begin in delimited text, and what parts them."""

from __future__ import annotations

from itertools import islice, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from actuator_glue.errors import InputError
from actuator_glue.io.formats.delimited import (
    DELIMITERS,
    fields_of,
    is_number,
    is_stamp,
    read_head,
)
from actuator_glue.io.signature import open_text
from actuator_glue.io.units import units_line

_LOOK = 300  # lines in which the samples must begin
_ROWS = 5  # rows of one shape that are samples


class _Rows(NamedTuple):
    """Rows of numbers as one delimiter parts them."""

    first: int
    delimiter: str | None
    numbers: list[int]
    width: int


def text_layout(path: Path) -> tuple[dict[str, Any], list[int]]:
    """Return entries of a channel map for a text, and the positions of its columns of numbers.

    Raises:
        InputError: no text, or no rows of at least two numbers near its beginning.
    """
    with open_text(path, errors='replace') as file:
        lines = [line.rstrip('\r\n') for line in islice(file, _LOOK)]
    found = [rows for d in (*DELIMITERS, None) if (rows := _first_rows(lines, d)) is not None]
    if not found:
        raise InputError(f'{path}: no rows of at least two numbers in the first {_LOOK} lines')
    # A wrong delimiter leaves entries that are no numbers.
    best = max(found, key=lambda rows: 2 * len(rows.numbers) - rows.width)
    entries: dict[str, Any] = {'header_lines': best.first}
    above = [
        fields_of(line, best.delimiter) for line in lines[max(best.first - 2, 0) : best.first]
    ]
    if len(above) == 2 and len(above[0]) >= 2 and units_line(above[1]):
        entries['header_lines'] = best.first - 1  # a line of units is found by itself
    read = read_head(path, entries['header_lines'])
    if best.delimiter is not None and best.delimiter != read.delimiter:
        entries['delimiter'] = best.delimiter
    return entries, best.numbers


def _first_rows(lines: list[str], delimiter: str | None) -> _Rows | None:
    """Return the first rows that have numbers at two positions at least.

    A position that is empty in some of them, and a number in others, is a column of numbers.
    """
    table = [(i, fields_of(line, delimiter)) for i, line in enumerate(lines) if line.strip()]
    for at, (first, _) in enumerate(table[:-1]):
        rows = [row for _, row in table[at : at + _ROWS]]
        columns = list(zip_longest(*rows, fillvalue=''))
        always = [i for i, column in enumerate(columns) if all(map(is_number, column))]
        sometimes = [
            i
            for i, column in enumerate(columns)
            if (any(map(is_number, column)) and all(is_number(e) or not e for e in column))
            or all(map(is_stamp, column))
        ]
        if len(always) >= 2:
            return _Rows(first, delimiter, sometimes, len(columns))
    return None
