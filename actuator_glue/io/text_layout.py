"""Where the rows of numbers begin in delimited text, and what parts them."""

from __future__ import annotations

import re
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from actuator_glue.errors import InputError
from actuator_glue.io.formats.delimited import (
    DELIMITERS,
    NUMBER,
    fields_of,
    is_number,
    is_remark,
    is_stamp,
    names_index,
    read_head,
    uncommented,
)
from actuator_glue.io.signature import open_text
from actuator_glue.io.units import bare, kinds_line, units_line

_LOOK = 300  # lines in which the samples must begin
_ABOVE = 6  # lines above the samples in which their names and units are
_ROWS = 5  # rows of one shape that are samples


class _Rows(NamedTuple):
    """Rows of numbers as one delimiter parts them."""

    first: int
    delimiter: str | None
    numbers: list[int]
    filled: int  # columns that are not empty

    def plain(self) -> re.Pattern[str]:
        """Return what a line matches whose entries are all numbers, which most lines are."""
        number = NUMBER.format(sign=r'\.' if self.delimiter == ',' else '[.,]')
        parted = '[ \t]+' if self.delimiter is None else f' *{re.escape(self.delimiter)} *'
        row = parted.join([number] * (self.numbers[-1] + 1))
        return re.compile(f' *{row}[ \r\n]*', re.ASCII | re.IGNORECASE)


class SampleRows(NamedTuple):
    """Rows of samples without anything between them: lines before the first, and how many."""

    lines: int
    rows: int


class TextLayout(NamedTuple):
    """How a text is laid out: entries of a channel map, columns of numbers, blocks of samples."""

    entries: dict[str, Any]
    numbers: list[int]
    blocks: list[SampleRows]


def text_layout(path: Path) -> TextLayout:
    """Return how a text is laid out; of several blocks of samples the entries name the longest.

    Raises:
        InputError: no text, or no rows of at least two numbers near its beginning.
    """
    with open_text(path, errors='replace') as file:
        lines = [line.rstrip('\r\n') for line in islice(file, _LOOK)]
    if not any(line.strip() for line in lines):
        raise InputError(f'{path}: the file is empty')
    found = [rows for d in (*DELIMITERS, None) if (rows := _first_rows(lines, d)) is not None]
    if not found:
        raise InputError(f'{path}: no rows of at least two numbers in the first {_LOOK} lines')
    # A wrong delimiter leaves entries that are no numbers.
    best = max(found, key=lambda rows: 2 * len(rows.numbers) - rows.filled)
    blocks, follows = _blocks(path, best, is_timed=False)
    if follows:
        head = read_head(path, blocks[0].lines)
        if head.stamps or any(bare(name) == 'time' for name in head.names):
            blocks, follows = _blocks(path, best, is_timed=True)
    chosen = max(blocks, key=lambda block: block.rows)
    entries: dict[str, Any] = {'header_lines': chosen.lines}
    if follows:
        entries['rows'] = chosen.rows
    read = read_head(path, entries['header_lines'])
    if best.delimiter is not None and best.delimiter != read.delimiter:
        entries['delimiter'] = best.delimiter
    return TextLayout(entries, best.numbers, blocks)


def _blocks(path: Path, like: _Rows, *, is_timed: bool) -> tuple[list[SampleRows], bool]:
    """Return the blocks of rows shaped like the first ones, and whether anything follows a block.

    A line of units above a block belongs to it: the reader finds such a line by itself. Comments
    among rows with times end no block: only a clock tells that none stands for a sample.
    """
    found: list[SampleRows] = []
    above: list[tuple[int, list[str]]] = []
    first, rows, empty, follows, last = 0, 0, 0, False, ''
    plain = like.plain()
    with open_text(path, errors='replace') as file:
        for at, line in enumerate(file):
            if at < like.first - _ABOVE:
                continue
            if rows and plain.fullmatch(line):
                rows += 1 + empty
                empty = 0
                continue
            entries = fields_of(line.rstrip('\r\n'), like.delimiter)
            if not any(entries):
                empty += bool(entries)  # delimiters alone are a row, where other rows follow
                continue
            if at >= like.first and _is_row(entries, like.numbers):
                if not rows:
                    names = _names_above(above)
                    first = at if names is None else names + 1
                rows += 1 + (empty if rows else 0)
                empty = 0
                continue
            if rows and is_timed and is_remark(line, like.delimiter, len(like.numbers)):
                continue
            if rows:
                found.append(SampleRows(first, rows))
                rows, follows, above = 0, True, []
            empty = 0
            text = uncommented(line.rstrip('\r\n'))
            if above and names_index(text, last):
                above = above[-1:]  # which has the other names
            else:
                above = [*above[-2:], (at, fields_of(text, like.delimiter))]
            last = text
    if rows:
        found.append(SampleRows(first, rows))
    return found, follows


def _names_above(above: list[tuple[int, list[str]]]) -> int | None:
    """Return which line names the columns: the last one above the samples, or above their units.

    Args:
        above: the last three lines above the samples that are not empty, with their positions.
    """
    if len(above) == 3 and kinds_line(above[2][1]) and len(above[1][1]) == len(above[2][1]):
        above = above[:2] if units_line(above[1][1]) else above
    if len(above) >= 2 and units_line(above[-1][1]):
        (upper, names), (lower, units) = above[-2:]
        if len(names) >= 2 and (lower == upper + 1 or len(names) == len(units)):
            return upper
    return above[-1][0] if above else None


def _is_row(entries: list[str], numbers: list[int]) -> bool:
    """Whether at least half of the columns of numbers hold one: others may be `NA`, or empty."""
    filled = [entries[i] for i in numbers if i < len(entries)]
    found = sum(is_number(entry) or is_stamp(entry) for entry in filled)
    return found >= max(1, len(filled) / 2) and len(filled) == len(numbers)


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
            filled = sum(any(column) for column in columns)
            return _Rows(first, delimiter, sometimes, filled)
    return None
