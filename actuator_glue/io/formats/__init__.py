"""Formats of laboratory files: each file of this folder is one, found by first bytes or suffix.

A format is a module with `FORMAT`; reading, writing and the help of the commands follow from it.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from actuator_glue import optional_library
from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import MOST_COLUMNS, ChannelMap
from actuator_glue.io.signature import beginning, unmarked
from actuator_glue.records import Array

# Bytes of numbers that one file may hold: a day and a half at 1 kHz with two channels.
LARGEST = 2 << 30
# Values that are no numbers: so few are a remark, and no column.
A_REMARK = 20


@dataclass(frozen=True, slots=True)
class Column:
    """Name of a column.

    Attributes:
        name: in full, as a channel map calls it, e.g. `test.command_mm`.
        label: what it is called without the place where it lies, e.g. `command_mm`.
        unit: what the file gives as its unit beside the name; empty where it says nothing.
        scaling: what the file says of a gain or an offset that is not applied
            (channel_attributes.py); empty where it says nothing.
    """

    name: str
    label: str
    unit: str = ''
    scaling: str = ''


@dataclass(frozen=True, slots=True)
class FileTable:
    """What a file holds.

    Attributes:
        columns: names, in order.
        notes: what it says besides: stiffness_N_per_m, hold, actuator.
        values: return the columns at positions from 0, each of shape (n,), unscaled.
        period: time between samples [s] where the file states one.
        start_ns: time from which its times count [ns], where the file states one; 0 elsewhere.
        entry: where a sample, from 0, of a column at a position is, and what is written there,
            for messages; None in files that no person reads.
        unread: columns that are no numbers, by their label, and what they hold.
        told: what a reader should know of what was taken, a line each.
    """

    columns: list[Column]
    notes: dict[str, str]
    values: Callable[[list[int]], list[Array]]
    period: float | None = None
    start_ns: int = 0
    entry: Callable[[int, int], str] | None = None
    unread: Mapping[str, str] = field(default_factory=dict)
    told: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Format:
    """One format of laboratory files; both functions raise `InputError`.

    Attributes:
        suffixes: of its files, lower case with the dot.
        read: table of a file; the channel map tells header lines, delimiter and decimal sign.
        write: write columns and notes to a path; None where such files are only read.
        begins: first bytes by which it is known whatever its suffix; empty for text.
        name: what such a file is called in messages.
        text: such files are text; one that begins otherwise is delimited text.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path, ChannelMap | None], FileTable]
    write: Callable[[Path, Mapping[str, Array], Mapping[str, str | float]], None] | None
    begins: bytes = b''
    name: str = 'delimited text'
    text: bool = False


@cache
def _formats() -> list[Format]:
    modules = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return [importlib.import_module(f'{__name__}.{name}').FORMAT for name in modules]


def formats() -> dict[str, Format]:
    """Return every format by its suffixes."""
    return {suffix: entry for entry in _formats() for suffix in entry.suffixes}


def writable() -> list[str]:
    """Return the suffixes of the formats that can be written."""
    return [suffix for suffix, entry in formats().items() if entry.write is not None]


def format_of(path: Path) -> Format:
    """Return the format of a file: by its first bytes, by its suffix, or else delimited text."""
    named = formats().get(path.suffix.lower())
    start = beginning(path) if path.is_file() else b''
    # The first bytes decide, whatever the suffix: a .mat may be an HDF5 file.
    found = [
        f
        for f in _formats()
        if f.begins and (unmarked(start) if f.text else start).startswith(f.begins)
    ]
    if named is not None and named.text and named not in found:
        named = None
    return next((f for f in found if f is not named), None) or named or formats()['.csv']


def library(name: str, path: Path) -> Any:
    """Return an optional library that a file needs.

    Raises:
        InputError: it is not installed; the message says what to install.
    """
    needed = f'{path}: {name.partition(".")[0]} is needed to read this file'
    return optional_library.library(name, needed, 'lab')


@contextmanager
def reading(path: Path, what: str) -> Iterator[None]:
    """Turn whatever a library raises over the bytes of a file into one clear message."""
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        detail = error.strerror or error
        raise InputError(f'{path}: {what} that cannot be read ({detail})') from error
    except Exception as error:  # damage shows in any of them
        raise InputError(f'{path}: damaged, or not {what} ({error})') from error


def check_size(size: int, path: Path) -> None:
    """Refuse numbers of more bytes than are read, before memory is taken for them.

    Raises:
        InputError: too many.
    """
    if size > LARGEST:
        raise InputError(
            f'{path}: {size / 1e9:.3g} GB of numbers, {LARGEST / 1e9:.3g} GB at most are read; '
            'cut the record into parts'
        )


def matrix_columns(
    name: str, shape: tuple[int, ...], unit: str = '', scaling: str = ''
) -> list[Column]:
    """Return the columns of a vector or matrix, as MATLAB calls them: `NAME(:,2)`, from 1.

    The longer side of a matrix is time; sides of length one do not count, as of 1x1xN. For any
    other shape, and for empty arrays, nothing is returned.
    """
    label = name.replace('/', '.').rpartition('.')[2]
    sides = _sides(shape)
    if not all(shape) or len(sides) > 2 or (len(sides) == 2 and min(sides) > MOST_COLUMNS):
        return []
    if len(sides) < 2:
        return [Column(name, label, unit, scaling)]
    pattern = '({},:)' if sides[0] < sides[1] else '(:,{})'
    places = [pattern.format(i + 1) for i in range(min(sides))]
    return [Column(name + place, label + place, unit, scaling) for place in places]


def matrix_column(matrix: Any, number: int) -> Any:
    """Return column `number` from 0 of what `matrix_columns` named: array or HDF5 dataset."""
    sides = _sides(matrix.shape)
    if len(sides) < 2:
        return matrix[...].reshape(-1)
    if len(matrix.shape) > 2:
        matrix = matrix[...].reshape(sides)
    return matrix[number, :] if sides[0] < sides[1] else matrix[:, number]


def _sides(shape: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(length for length in shape if length != 1)
