"""Lines of text to columns, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal, InvalidOperation
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.records import Array
from actuator_glue.streams.layout import Field, Layout

LONGEST = 8192  # bytes of a line; one without end is no line


def places(layout: Layout, names: Sequence[str] | None) -> dict[str, int]:
    """Return the column, from 0, of each field.

    Args:
        layout: fields in order, or with a column of their own.
        names: names of the columns, where they are known.

    Raises:
        LookupError: a named column is not there, or there twice.
    """
    found: dict[str, int] = {}
    place = 0
    for field in layout.sample:
        at = place if field.column is None else field.column
        place += field.count
        if not field.role:
            continue
        if isinstance(at, str):
            held = [i for i, name in enumerate(names or ()) if name == at]
            if len(held) != 1:
                raise LookupError(f'column {at} is {"there twice" if held else "not in it"}')
            found[field.name] = held[0]
        else:
            found[field.name] = at if field.column is None else at - 1
    return found


def sent_columns(layout: Layout) -> list[Field]:
    """Return the field in each column that is sent, so that `places` finds all of them."""
    listed = [field for field in layout.sample for _ in range(field.count)]
    at = {i: field for i, field in enumerate(listed) if field.column is None}
    at |= {f.column - 1: f for f in layout.sample if isinstance(f.column, int)}
    free = (i for i in count() if i not in at)
    for field in listed:
        if isinstance(field.column, str):
            at[next(free)] = field
    return [at.get(i, Field('unused')) for i in range(max(at) + 1)]


def sent_values(field: Field, values: Mapping[str, Array]) -> Array:
    """Return a column as it is sent, zeros for what is stepped over; `values` by field, in SI."""
    if not field.role:
        return np.zeros(len(values['command']))
    return values['counter'] if field.name == 'counter' else field.sent(values[field.name])


def label(field: Field) -> str:
    """Return the name of the column of a field that is sent."""
    return field.column if isinstance(field.column, str) else field.name


class Lines:
    """Lines of one layout; `begin` before the first of a connection.

    Attributes:
        by_name: a column is found by its name: the first line has to name them.
        odd: what the last line that cannot be read is, and what was expected; empty without one.

    Raises:
        InputError: the layout is one of packets.
    """

    def __init__(self, layout: Layout) -> None:
        if layout.packet or layout.samples > 1:
            raise InputError(
                f'{layout.source or "layout"}: a line holds one sample; leave out packet and '
                'samples, or receive datagrams (udp://)'
            )
        self._layout = layout
        self.by_name = any(isinstance(field.column, str) for field in layout.sample if field.role)
        self.odd = ''
        self.begin()

    def begin(self) -> None:
        """Forget the names of columns."""
        self._places: dict[str, int] | None = None
        # Entries of a line; None while columns are known by their number alone, and no line yet.
        self._width: int | None = None
        if all(field.column is None for field in self._layout.sample):
            self._width = sum(field.count for field in self._layout.sample)
        if not self._layout.header:
            try:
                self._places = places(self._layout, None)
            except LookupError:
                self._places = None  # named columns: the first line must name them

    def decoded(self, lines: Sequence[bytes]) -> tuple[dict[str, NDArray[Any]], int]:
        """Return the values by field, as sent, and how many lines cannot be read.

        A line with more or fewer entries than the others counts as unreadable: a decimal comma, or
        an undeclared column, would put one value in another's place.
        """
        bad = 0
        rows: list[list[float]] = []
        for line in lines:
            entries = self._entries(line)
            why = ''
            if self._places is None:
                why = self._take_names(entries)
            else:
                try:
                    rows.append(self._row(entries, self._places))
                except (ValueError, IndexError) as error:
                    # The columns may be named once more, in another order.
                    if not self.by_name or self._take_names(entries):
                        why = str(error)
            if why:
                bad += 1
                shown = line[:60].decode('utf-8', 'replace').strip()
                self.odd = f'the last one is {shown!r}: {why}'
        table = np.array(rows, dtype=np.float64).reshape(len(rows), len(self._layout.fields))
        fields = self._places or self._layout.fields
        return dict(zip(fields, table.T, strict=False)), bad

    def _take_names(self, entries: Sequence[str]) -> str:
        """Take the names of the columns; return why that cannot be, empty where it can."""
        names = [entry.strip(' "') for entry in entries]
        try:
            self._places, self._width = places(self._layout, names), len(names)
        except LookupError as error:
            return str(error)
        return ''

    def _row(self, entries: Sequence[str], at: Mapping[str, int]) -> list[float]:
        if len(entries) != (self._width or len(entries)):
            raise ValueError(f'{len(entries)} entries in place of {self._width}')
        row = [_number(entries[place], name) for name, place in at.items()]
        self._width = len(entries)
        return row

    def _entries(self, line: bytes) -> list[str]:
        """Return the entries of a line; an empty one behind the last delimiter is none."""
        delimiter = self._layout.delimiter
        text = line.decode('utf-8-sig', 'replace').rstrip('\r')
        entries = text.split() if delimiter == ' ' else text.split(delimiter)
        return entries[:-1] if len(entries) > 1 and not entries[-1].strip() else entries

    def encoded(self, values: Mapping[str, Array]) -> list[bytes]:
        """Return one line per sample, without its end; fields in the layout's order."""
        columns: list[list[str]] = []
        for field in sent_columns(self._layout):
            counts = field.name == 'counter' or not field.role
            kind: type[int] | type[float] = int if counts else float
            columns.append([repr(kind(v)) for v in sent_values(field, values)])
        delimiter = self._layout.delimiter
        return [delimiter.join(row).encode() for row in zip(*columns, strict=True)]

    def head(self) -> bytes:
        """Return the line that names the columns."""
        names = [label(field) for field in sent_columns(self._layout)]
        return self._layout.delimiter.join(names).encode()


def _number(text: str, name: str) -> float:
    """Return the number that an entry is.

    Raises:
        ValueError: it is none, or a counter printed with too few digits to count.
    """
    if '_' in text:
        raise ValueError('Python alone reads 1_000 as a number')
    value = float(text)
    if name == 'counter' and 'e' in text.lower():
        try:
            coarse = int(Decimal(text.strip()).as_tuple().exponent) > 0
        except (InvalidOperation, ValueError):
            return value  # infinity, NaN: told as such
        if coarse:
            raise ValueError(f'{text} is no count: its last digit is not that of ones')
    return value
