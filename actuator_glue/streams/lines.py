"""Lines of text to columns, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal, InvalidOperation
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.records import Array
from actuator_glue.streams.layout import Layout

LONGEST = 8192  # bytes of a line; one without end is no line


def places(layout: Layout, names: Sequence[str] | None) -> dict[str, int]:
    """Return the column, from 0, of each field.

    Args:
        layout: fields in order, or with a column of their own.
        names: names of the columns, where they are known.

    Raises:
        LookupError: a named column is not there.
    """
    found: dict[str, int] = {}
    place = 0
    for field in layout.sample:
        at = place if field.column is None else field.column
        place += field.count
        if not field.role:
            continue
        if isinstance(at, str):
            if names is None or at not in names:
                raise LookupError(at)
            found[field.name] = list(names).index(at)
        else:
            found[field.name] = at if field.column is None else at - 1
    return found


class Lines:
    """Lines of one layout; `begin` before the first of a connection.

    Args:
        layout: what a line holds.

    Attributes:
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
            if self._places is None:
                names = [entry.strip(' "') for entry in entries]
                try:
                    self._places, self._width = places(self._layout, names), len(names)
                except LookupError as error:
                    bad += 1
                    self._tell(line, f'column {error} is not in it')
                continue
            try:
                if len(entries) != (self._width or len(entries)):
                    raise ValueError(f'{len(entries)} entries in place of {self._width}')
                row = [_number(entries[at], name) for name, at in self._places.items()]
            except (ValueError, IndexError) as error:
                bad += 1
                self._tell(line, str(error))
                continue
            self._width = len(entries)
            rows.append(row)
        table = np.array(rows, dtype=np.float64).reshape(len(rows), len(self._layout.fields))
        fields = self._places or self._layout.fields
        return dict(zip(fields, table.T, strict=False)), bad

    def _tell(self, line: bytes, why: str) -> None:
        shown = line[:60].decode('utf-8', 'replace').strip()
        self.odd = f'the last one is {shown!r}: {why}'

    def _entries(self, line: bytes) -> list[str]:
        """Return the entries of a line; an empty one behind the last delimiter is none."""
        delimiter = self._layout.delimiter
        text = line.decode('utf-8', 'replace').rstrip('\r')
        entries = text.split() if delimiter == ' ' else text.split(delimiter)
        return entries[:-1] if len(entries) > 1 and not entries[-1].strip() else entries

    def encoded(self, values: Mapping[str, Array]) -> list[bytes]:
        """Return one line per sample, without its end; fields in the layout's order."""
        delimiter = self._layout.delimiter
        columns: list[list[str]] = []
        size = len(values['command'])
        for field in self._layout.sample:
            if field.name == 'counter':
                columns.append([str(int(v)) for v in values['counter']])
            elif field.role:
                columns.append([repr(float(v)) for v in field.sent(values[field.name])])
            else:
                columns += [['0'] * size] * field.count
        return [delimiter.join(row).encode() for row in zip(*columns, strict=True)]

    def head(self) -> bytes:
        """Return the line that names the columns."""
        names = []
        for field in self._layout.sample:
            name = field.column if isinstance(field.column, str) else field.name
            names += [name] * field.count
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
