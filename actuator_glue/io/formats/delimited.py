"""Columns of numbers out of delimited text."""

from __future__ import annotations

import csv
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import Column, FileTable, Format
from actuator_glue.io.signature import text_encoding
from actuator_glue.io.units import EXAMPLE, recognise, units_line
from actuator_glue.records import Array

_ROWS = 10_000  # rows formatted at a time
# A comma may be the decimal sign where there is another delimiter, so it comes last.
DELIMITERS = (';', '\t', ',')


@dataclass(frozen=True, slots=True)
class TextHead:
    """What the lines before the samples say.

    Attributes:
        names: column names; empty where there are none.
        units: of the columns, where a line below the names holds them.
        lines: lines before the first sample.
        delimiter: text between columns, None for blanks.
        notes: `# name = value` lines.
        decimal: decimal sign of the first sample.
        encoding: how the text is coded.
    """

    names: list[str]
    lines: int
    delimiter: str | None
    notes: dict[str, str]
    decimal: str
    encoding: str = 'utf-8-sig'
    units: tuple[str, ...] = ()


def read_head(
    path: Path, header_lines: int | None = None, delimiter: str | None = None
) -> TextHead:
    """Return the head of a file.

    Args:
        path: the file.
        header_lines: lines before the first sample, the last naming the columns; None where
            `#` lines and one line of names are all there is.
        delimiter: text between columns, found by itself where None.

    Raises:
        InputError: the file cannot be read, is no text or is empty.
    """
    encoding = text_encoding(path)
    try:
        with path.open(encoding=encoding, errors='replace') as file:
            top = [line.rstrip('\r\n') for line in islice(file, (header_lines or 100) + 2)]
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror})') from error
    if not any(line.strip() for line in top):
        raise InputError(f'{path}: the file is empty')
    notes: dict[str, str] = {}
    if header_lines is None:
        header_lines = 0
        while header_lines < len(top) and top[header_lines].lstrip().startswith('#'):
            name, sign, value = top[header_lines].lstrip('# ').partition('=')
            if sign:
                notes[name.strip()] = value.strip()
            header_lines += 1
        header_lines += 1
    if len(top) < header_lines:
        raise InputError(f'{path}: {len(top)} lines, but {header_lines} header lines expected')
    line = top[header_lines - 1] if header_lines else ''
    units: list[str] = []
    if header_lines and len(top) > header_lines:
        parting = delimiter or delimiter_of(top[header_lines])
        units = units_line(fields_of(top[header_lines], parting))
    header_lines += bool(units)
    sample = top[header_lines] if len(top) > header_lines else line
    if delimiter is None:
        delimiter = delimiter_of(sample)
    # With both signs in a line the comma can only part thousands, which nobody can read safely.
    comma = any(',' in field for field in fields_of(sample, delimiter))
    decimal = ',' if comma and '.' not in sample else '.'
    names = fields_of(line, delimiter)
    return TextHead(names, header_lines, delimiter, notes, decimal, encoding, tuple(units))


def delimiter_of(line: str) -> str | None:
    """Return the delimiter of a line, None for blanks."""
    return next((d for d in DELIMITERS if d in line), None)


def fields_of(line: str, delimiter: str | None) -> list[str]:
    """Return the entries of a line without the quotes about them."""
    if not line.strip():
        return []
    if delimiter is None:
        return [entry.strip('"') for entry in line.split()]
    if len(delimiter) != 1:  # csv takes one character
        return [entry.strip().strip('"') for entry in line.split(delimiter)]
    (entries,) = csv.reader([line], delimiter=delimiter, skipinitialspace=delimiter != ' ')
    return [entry.strip() for entry in entries]


def read_columns(
    path: Path, head: TextHead, positions: list[int], decimal: str | None = None
) -> Array:
    """Return columns of numbers, shape (n, number of columns).

    Args:
        path: the file.
        head: its head.
        positions: columns wanted, from 0.
        decimal: decimal sign, the head's where None.

    Raises:
        InputError: a value is no number, a row is short, or there is no row.
    """
    convert = None
    if (decimal or head.decimal) == ',':

        def convert(text: str) -> float:
            return float(text.replace(',', '.'))

    try:
        with warnings.catch_warnings():
            # numpy warns of a file without samples; that is told below.
            warnings.simplefilter('ignore', UserWarning)
            columns: Array = np.loadtxt(
                path,
                delimiter=head.delimiter,
                skiprows=head.lines,
                usecols=positions,
                ndmin=2,
                encoding=head.encoding,
                converters=convert,
                quotechar='"',
            )
    except UnicodeDecodeError as error:
        raise InputError(
            f'{path}: not plain text in {head.encoding} (byte {error.start}); save it as UTF-8'
        ) from error
    except (ValueError, IndexError) as error:
        detail = ' '.join(str(error).split()).removesuffix('.')
        raise InputError(
            f'{path}: cannot read the samples: {detail} (rows are counted after the '
            f'{head.lines} header lines)'
        ) from error
    if not len(columns):
        raise InputError(f'{path}: no samples after the {head.lines} header lines')
    return columns


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    if channels is None:
        head, decimal = read_head(path), None
        if not any(recognise(name) for name in head.names) and _numeric(head.names):
            raise InputError(
                f'{path}: the first line must name the columns with their units, as in '
                f'{EXAMPLE}; or describe the file with --channels MAP.yaml'
            )
    else:
        head = read_head(path, channels.header_lines, channels.delimiter)
        decimal = channels.decimal
    units = [*head.units, *[''] * len(head.names)]
    return FileTable(
        [Column(name, name, unit) for name, unit in zip(head.names, units, strict=False)],
        head.notes,
        lambda at: list(read_columns(path, head, at, decimal).T),
    )


def _numeric(names: list[str]) -> bool:
    try:
        [float(name) for name in names]
    except ValueError:
        return False
    return True


def _write(path: Path, columns: Mapping[str, Array], notes: Mapping[str, str | float]) -> None:
    table = np.column_stack(list(columns.values()))
    with path.open('w', encoding='utf-8', newline='\n') as file:
        for name, value in notes.items():
            file.write(f'# {name} = {value}\n')
        file.write(','.join(columns) + '\n')
        for start in range(0, len(table), _ROWS):
            rows = table[start : start + _ROWS].tolist()
            file.writelines(','.join(map(repr, row)) + '\n' for row in rows)


FORMAT = Format(('.csv',), _read, _write)
