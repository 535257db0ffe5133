"""YAML files that people write: read safely, every entry checked, with a hint where one errs."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from reprlib import repr as brief
from typing import Any

import yaml

from actuator_glue.errors import InputError
from actuator_glue.given import path as path_given
from actuator_glue.io.signature import text_encoding
from actuator_glue.plain_yaml import plain_yaml

LARGEST = 100_000  # bytes; a map or layout is a page of text
_PACKAGE = Path(__file__).resolve().parent.parent
# Inside {...} YAML reads the [s] of `column: Time [s]` as a list.
_BRACKETS = re.compile(r'column:\s*[^\'"\s][^\'",}]*\[')
QUOTES = "put quotes around names with brackets, as in column: 'Time [s]'"


def shipped(folder: str) -> list[str]:
    """Return the names of the files of a folder (layouts, ...) that come with the package."""
    return sorted(p.stem for p in (_PACKAGE / folder).glob('*.yaml'))


def located(given: Path | str, folder: str) -> Path:
    """Return the file that is meant: the one there is, or else one of the package by its name.

    Args:
        given: a path, or the name of a file of the package, with or without `.yaml`.
        folder: of the package where such files are.
    """
    path = path_given(given)
    if len(path.parts) == 1 and not path.is_file() and path.stem in shipped(folder):
        own = _PACKAGE / folder / f'{path.stem}.yaml'
        return own if path.suffix in ('', own.suffix) else path
    return path


def read_file(
    given: Path | str, what: str, hint: str, folder: str, largest: int = LARGEST
) -> tuple[Path, object]:
    """Return a YAML file, there or of the package by its name, and what it says.

    Args:
        given: as `located`.
        what: it is to be, for messages.
        hint: said where it is far too large for that.
        folder: of the package where such files are.
        largest: bytes that are read.

    Raises:
        InputError: as `read_text` and `parse`.
    """
    path = located(given, folder)
    return path, parse(read_text(path, what, hint, folder, largest), f'{path}: {what}')


def read_text(path: Path, what: str, hint: str, folder: str, largest: int = LARGEST) -> str:
    """Return the text of a YAML file; arguments as of `read_file`.

    Raises:
        InputError: no such file, too large, no text.
    """
    try:
        size = path.stat().st_size
        if size > largest:
            raise InputError(f'{path}: {size / 1e3:.0f} kB are no {what}; {hint}')
        return path.read_text(text_encoding(path))
    except OSError as error:
        names = ', '.join(shipped(folder))
        ours = f', or one of {names}' if names else ''
        raise InputError(
            f'{path}: {what} cannot be read ({error.strerror}); give a YAML file{ours}'
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(f'{path}: {what} is not text in UTF-8') from error


def parse(text: str, where: str) -> object:
    """Return what YAML text says; only plain data, no objects.

    Args:
        text: the text.
        where: file and what it is to be, for messages.

    Raises:
        InputError: no YAML, or a key twice in one mapping.
    """
    try:
        return plain_yaml(text, where)
    except InputError:
        raise
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        # ValueError: a date such as 2001-99-99; RecursionError: a thousand brackets.
        detail = ' '.join(str(error).split())
        hint = f'; {QUOTES}' if _BRACKETS.search(text) else ''
        raise InputError(f'{where} is not YAML ({detail}){hint}') from error


def entries(content: object, known: Iterable[str], where: str) -> dict[str, Any]:
    """Return the entries of a mapping that say something, all of which must be known.

    Raises:
        InputError: no mapping, or an unknown entry.
    """
    if not isinstance(content, Mapping):
        raise InputError(f'{where} must be a mapping of names to values, not {brief(content)}')
    known = [*known]
    for name in content:
        if name not in known:
            near = difflib.get_close_matches(str(name), known, 1)
            hint = f'did you mean {near[0]}?' if near else f'known are {", ".join(known)}'
            raise InputError(f'{where}: unknown entry {name!r}; {hint}')
    return {name: value for name, value in content.items() if value is not None}


def mapping(
    content: object, kind: type, where: str, hidden: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Return the entries of a mapping that has the fields of a dataclass, and only those.

    Args:
        content: what the YAML says.
        kind: the dataclass; fields without a default are needed.
        where: place in the file, for messages.
        hidden: fields that no file may give.

    Raises:
        InputError: no mapping, an unknown or missing entry.
    """
    values = entries(content, (f.name for f in fields(kind) if f.name not in hidden), where)
    for entry in fields(kind):
        if entry.default is MISSING and entry.default_factory is MISSING:
            needed(values, entry.name, where)
    return values


def needed(values: Mapping[str, Any], name: str, where: str) -> Any:
    """Return an entry that must be there.

    Raises:
        InputError: it is not.
    """
    if name not in values:
        raise InputError(f'{where}: {name} is missing')
    return values[name]


def choice(values: Mapping[str, Any], name: str, allowed: tuple[object, ...], where: str) -> None:
    """Hold an entry, where it is there, to some values.

    Raises:
        InputError: another one.
    """
    if name in values and values[name] not in allowed:
        listed = ', '.join(map(str, allowed))
        raise InputError(f'{where}: {name} is {brief(values[name])}; use one of {listed}')


def texts(values: Mapping[str, Any], names: tuple[str, ...], where: str) -> None:
    """Hold entries, where they are there, to text.

    Raises:
        InputError: something else.
    """
    for name in names:
        if not isinstance(values.get(name, ''), str):
            raise InputError(f'{where}: {name} must be text, not {brief(values[name])}')


def number(
    values: dict[str, Any], name: str, where: str, lower: float = -1e15, upper: float = 1e15
) -> None:
    """Make an entry, where it is there, a number within limits.

    Raises:
        InputError: no number, or outside.
    """
    value = values.get(name)
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise InputError(f'{where}: {name} must be a number, not {brief(value)}')
    try:
        # YAML 1.1 reads 1e6 without a point as text.
        values[name] = float(value)
    except (ValueError, OverflowError) as error:
        raise InputError(f'{where}: {name} must be a number, not {brief(value)}') from error
    if not lower <= values[name] <= upper:
        raise InputError(f'{where}: {name} = {value} is outside [{lower:g}, {upper:g}]')


def whole(
    values: dict[str, Any], name: str, where: str, lower: int = 0, upper: int = 10**9
) -> None:
    """Hold an entry, where it is there, to a whole number within limits.

    Raises:
        InputError: no whole number, or outside.
    """
    value = values.get(name)
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, int) or not lower <= value <= upper:
        raise InputError(
            f'{where}: {name} must be a whole number of at least {lower}, not {brief(value)}'
        )
