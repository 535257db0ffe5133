"""Numbers as callers give them: of every usual type, or refused with the argument's name."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from io import IOBase
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, SupportsFloat, cast

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def number(value: object, name: str) -> float:
    """Return a number of Python's or numpy's, or an array without axes, as a float.

    Args:
        value: what was given.
        name: of the argument, for the message.

    Raises:
        InputError: something else, or NaN.
    """
    if not isinstance(value, (bool, np.bool_, str, bytes)) and getattr(value, 'ndim', 0) == 0:
        try:
            found = float(cast(SupportsFloat, value))
        except (TypeError, ValueError, OverflowError):
            pass
        else:
            if not math.isnan(found):
                return found
    raise InputError(f'{name} is {_shown(value)}, which is no number; give one number')


def whole(value: object, name: str) -> int:
    """Return a whole number, whatever its type, as an int; 6e4 is one.

    Raises:
        InputError: as `number`, or a fraction.
    """
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    found = number(value, name)
    if not found.is_integer():
        raise InputError(f'{name} is {_shown(value)}; give a whole number')
    return int(found)


def one_thing(value: object) -> bool:
    """Whether a value is one thing, and not several given together, though it can be iterated.

    A path is not its letters, a table not its columns, a mapping not its keys, an open file not
    its lines.
    """
    return isinstance(value, (str, bytes, PathLike, Mapping, IOBase)) or hasattr(value, 'columns')


def path(value: object, name: str = 'path') -> Path:
    """Return the path of a file or folder, whatever holds it; a `~` in front is the home folder.

    Args:
        value: what was given.
        name: of the argument, for the message.

    Raises:
        InputError: None, a number, bytes or another thing that is no path.
    """
    of_kind(value, name, (str, PathLike), "the name of a file, as 'monday.npz'")
    try:
        return Path(at_home(cast('str | PathLike[str]', value)))
    except TypeError:
        raise InputError(f'{name} is {_shown(value)}; give it as text') from None


def at_home(text: str | PathLike[str]) -> str:
    """Return a path with the home folder in place of a `~` in front; `~$test.csv` stays."""
    text = os.fspath(text)
    if not text.startswith('~'):
        return text
    try:
        return str(Path(text).expanduser())
    except RuntimeError:  # no home of that name
        return text


def of_kind(value: object, name: str, kinds: type | tuple[type, ...], wanted: str) -> None:
    """Refuse a value of a kind that cannot be used, before something is asked of it.

    Args:
        value: what was given.
        name: of the argument, for the message.
        kinds: a class, or several.
        wanted: what can be given, for the message.

    Raises:
        InputError: it is of another kind.
    """
    if not isinstance(value, kinds):
        raise InputError(f'{name} is {_shown(value)}; give {wanted}')


def one_of(value: object, name: str, known: Sequence[str]) -> None:
    """Refuse what is none of the words known.

    Raises:
        InputError: another word, or none.
    """
    if not isinstance(value, str) or value not in known:
        raise InputError(f'{name} {_shown(value)} is unknown; use one of {", ".join(known)}')


def vector(value: object, name: str) -> NDArray[np.float64]:
    """Return numbers as an array, of whatever shape they were given in.

    Raises:
        InputError: something else.
    """
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(
            f'{name} is {_shown(value)}, which holds no numbers; give numbers'
        ) from None


def names(value: object, name: str) -> tuple[str, ...]:
    """Return names that were given as one text or as several.

    Raises:
        InputError: something else.
    """
    found = (value,) if isinstance(value, str) or not isinstance(value, Iterable) else tuple(value)
    if not all(isinstance(one, str) for one in found):
        raise InputError(f'{name} is {_shown(value)}; give one name, or several')
    return found


def take_numbers(options: DataclassInstance, but: Iterable[str] = ()) -> None:
    """Make the numbers of a frozen dataclass what it declares: floats, ints and truth values.

    Args:
        options: whose fields are declared as `int`, `float` or `bool`, perhaps `| None` or
            `| Literal[...]`; others are left alone.
        but: fields that are left alone, too.

    Raises:
        InputError: a field that holds none.
    """
    for each in fields(options):
        value, kind = getattr(options, each.name), str(each.type)
        if each.name in but or (value is None and 'None' in kind):
            continue
        if isinstance(value, str) and 'Literal' in kind:
            continue
        if kind.startswith('float'):
            object.__setattr__(options, each.name, number(value, each.name))
        elif kind.startswith('int'):
            object.__setattr__(options, each.name, whole(value, each.name))
        elif kind == 'bool':
            if not isinstance(value, (bool, np.bool_)):
                raise InputError(f'{each.name} is {_shown(value)}; give True or False')
            object.__setattr__(options, each.name, bool(value))


def _shown(value: object) -> str:
    """Return a value for a message, in a few words."""
    shape = getattr(value, 'shape', ())
    if shape:
        return f'an array of shape {shape}'
    text = repr(value)
    return text if len(text) < 40 else f'a {type(value).__name__}'
