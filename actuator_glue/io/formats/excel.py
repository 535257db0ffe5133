"""Columns out of Excel workbooks (.xlsx), read only; needs openpyxl.

The first sheet that holds the channels counts, else the first with numbers: names in one row, with
units in the next one or not.
Workbooks are no place for measured records (a million rows at most), so none is written.
"""

from __future__ import annotations

import math
import zipfile
from array import array
from collections.abc import Iterable
from datetime import UTC, datetime, time, timedelta
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.file_notes import add_note, stated, take_note
from actuator_glue.io.formats import Column, FileTable, Format, library, reading
from actuator_glue.io.noted_rate import take_rate
from actuator_glue.io.units import bare, units_line
from actuator_glue.records import Array

_NAME = 'an Excel workbook (.xlsx)'
_LARGEST = 1 << 30  # bytes of XML; a million rows of ten columns are a third of it
_SHARED = 64 << 20  # bytes of texts, which are kept in memory
_HEAD = 50  # rows in which the names must be


class _Sheet(NamedTuple):
    """A sheet with numbers: the rows above its first sample, its columns, those of times."""

    sheet: Any
    above: list[tuple[Any, ...]]
    columns: list[Column]
    timed: set[int]

    def like(self, other: _Sheet) -> bool:
        """Whether they have a name in common: the numbers of a map fit any sheet."""
        return not {c.name for c in self.columns}.isdisjoint(c.name for c in other.columns)


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    openpyxl = library('openpyxl', path)
    with reading(path, _NAME):
        _check(path)
        book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        try:
            found = [one for sheet in book.worksheets if (one := _sheet(sheet, channels))]
            whole = [one for one in found if _holds(one.columns, channels)]
            if found:
                chosen = (whole or found)[0]
                columns, skip = chosen.columns, len(chosen.above)
                rows = chosen.sheet.iter_rows(min_row=skip + 1, values_only=True)
                table = _numbers(
                    rows, [i in chosen.timed for i in range(len(columns))], skip, path
                )
                return FileTable(
                    columns,
                    _notes(chosen.above, path),
                    lambda places: [table[:, at] for at in places],
                    entry=lambda row, at: f'row {skip + row + 1} of column {columns[at].name!r}',
                    told=_told([one.sheet.title for one in whole if chosen.like(one)]),
                )
        finally:
            book.close()
    raise InputError(
        f'{path}: no sheet with named columns of numbers in this workbook; numbers that are kept '
        'as text are none'
    )


def _sheet(sheet: Any, channels: ChannelMap | None) -> _Sheet | None:
    """Return what a sheet holds; None where it has no numbers."""
    sheet.reset_dimensions()  # what the file claims may be wrong
    head = list(islice(sheet.iter_rows(values_only=True), _HEAD))
    lines = channels.header_lines if channels is not None else None
    first = _first_sample(head) if lines is None else lines
    if first is None or not any(_is_number(v) for row in head[first:] for v in row):
        return None
    timed = _timed(head[first:])
    return _Sheet(sheet, head[:first], _columns(head, first, timed), timed)


def _holds(columns: list[Column], channels: ChannelMap | None) -> bool:
    """Whether a sheet has all channels that a record needs."""
    if channels is None:
        return {'time', 'command', 'measured'} <= {bare(column.label) for column in columns}
    labels: set[str | int] = {name for c in columns for name in (c.name, c.label)}
    wanted = {channel.column for channel in channels.roles().values()}
    return wanted <= labels.union(range(1, len(columns) + 1))


def _told(sheets: list[str]) -> tuple[str, ...]:
    if len(sheets) < 2:
        return ()
    others = ', '.join(map(repr, sheets[1:]))
    return (
        f'sheet {sheets[0]!r} is read, and {others} could be as well; save each record as a file '
        'of its own',
    )


def _check(path: Path) -> None:
    """Refuse a workbook that unpacks to more than is read."""
    with zipfile.ZipFile(path) as archive:
        for entry in archive.infolist():
            limit = _LARGEST if 'worksheets/' in entry.filename else _SHARED
            if entry.file_size > limit:
                raise InputError(
                    f'{path}: {entry.filename} unpacks to {entry.file_size / 1e6:.0f} MB; save '
                    'the table as .csv'
                )


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_time(value: Any) -> bool:
    return isinstance(value, (datetime, time, timedelta))


def _first_sample(head: list[tuple[Any, ...]]) -> int | None:
    """Return the row from 0 of the first sample: most of its cells are numbers or times.

    The next row has numbers, too: below a row of settings there are names.
    """
    rows = [(i, row) for i, row in enumerate(head) if any(v is not None for v in row)]
    for (i, row), (_, below) in zip_longest(rows, rows[1:], fillvalue=(0, (0.0,))):
        filled = [v for v in row if v is not None]
        numbers = sum(map(_is_number, filled))
        most = numbers + sum(map(_is_time, filled)) > max(len(filled) / 2, 1)
        if numbers and most and any(map(_is_number, below)):
            return i
    return None


def _timed(rows: list[tuple[Any, ...]]) -> set[int]:
    """Return the positions of columns whose first value is a date, a time of day or a duration."""
    firsts: dict[int, Any] = {}
    for row in rows:
        for at, value in enumerate(row):
            if value is not None:
                firsts.setdefault(at, value)
    return {at for at, value in firsts.items() if _is_time(value)}


def _columns(head: list[tuple[Any, ...]], first: int, timed: set[int]) -> list[Column]:
    """Return the names above the first sample, with the units between where there are some."""
    texts = [[str(v).strip() if v is not None else '' for v in row] for row in head[:first]]
    rows = [row for row, text in zip(head, texts, strict=False) if any(text)]
    above = [row for row in texts if any(row)][-2:]
    units: list[str] = []
    if len(above) == 2 and (found := units_line(above[1])):
        units, above = found, above[:1]
    # A cell merged over both rows has its text in the upper one; a title stands alone.
    merged = len(above) == 2 and sum(map(bool, above[0])) > 1
    if not units and rows and _is_setting(rows[-1], head[first], alone=not merged):
        above, merged = [], False
    names = above[-1] if above else [str(i + 1) for i in range(len(head[first]))]
    if merged:
        names = [lower or upper for upper, lower in zip_longest(*above, fillvalue='')]
    units += [''] * (len(names) - len(units))
    # Dates and times of day are seconds, whatever their column is called.
    return [
        Column(n, bare(n) if at in timed else n, 's' if at in timed else u)
        for at, (n, u) in enumerate(zip(names, units, strict=False))
    ]


def _notes(rows: list[tuple[Any, ...]], path: Path) -> dict[str, str]:
    """Return what stands above the names: `hold` and `linear` in two cells, or `# hold = linear`.

    A number may have its unit in a third cell. Other words than those of `NOTES` are the
    laboratory's own.
    """
    notes: dict[str, str] = {}
    for row in rows:
        filled = [v for v in row if v is not None]
        name, *value = [str(v).strip() for v in filled] or ['']
        said: dict[str, str] = {}
        if len(value) == 1 or (len(value) == 2 and _is_number(filled[1])):
            said = {name.lstrip('# '): ' '.join(value)}
        elif not value and name.startswith('#'):
            take_note(name.lstrip('# '), said, str(path))
        else:
            take_rate('\t'.join([name, *value]).lstrip('# '), said)
        for key, text in stated(said).items():
            add_note(notes, key, text, str(path))
    return notes


def _is_setting(row: tuple[Any, ...], sample: tuple[Any, ...], *, alone: bool) -> bool:
    """Whether a row above the first sample names no columns: `Rate`, 1000, or a title alone."""
    filled = [v for v in row if v is not None]
    title = alone and len(filled) == 1
    return len(filled) < sum(v is not None for v in sample) and (
        title or any(map(_is_number, filled))
    )


def _numbers(rows: Iterable[tuple[Any, ...]], timed: list[bool], skip: int, path: Path) -> Array:
    """Return the cells below the head, shape (n, width); text and empty cells are NaN.

    So are times among numbers, and numbers among times.
    """
    read, width = array('d'), len(timed)
    for row in rows:
        cells = [_number(v, timed=t) for v, t in zip(row, timed, strict=False)]
        read.extend(cells + [math.nan] * (width - len(cells)))
    table = np.frombuffer(read).reshape(-1, width)
    (filled,) = np.nonzero((~np.isnan(table)).any(axis=1))
    if not len(filled):
        raise InputError(f'{path}: no samples after the {skip} header rows')
    return table[: int(filled[-1]) + 1]  # formatted rows may follow


def _number(value: Any, *, timed: bool) -> float:
    """Return a number, or seconds of what is a time; NaN for what is neither."""
    if not timed:
        return float(value) if _is_number(value) else math.nan
    if isinstance(value, datetime):
        return value.replace(tzinfo=UTC).timestamp()
    if isinstance(value, time):  # of a day
        return (datetime.combine(datetime.min, value) - datetime.min).total_seconds()
    if isinstance(value, timedelta):
        return value.total_seconds()
    return math.nan


FORMAT = Format(('.xlsx',), _read, None, name=_NAME)
