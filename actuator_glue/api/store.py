"""Results as one file: typed dataclasses and their arrays in an .npz, nothing pickled."""

from __future__ import annotations

import dataclasses
import json
import types
import typing
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.given import path as given_path
from actuator_glue.model.effects import CATALOGUE
from actuator_glue.whole_file import whole_file

T = TypeVar('T')
_CONTENT = 'content'


def save(
    path: Path | str, schema: str, value: Any, effects: Iterable[str] = (), **more: Any
) -> Path:
    """Write a dataclass to one .npz file and return its path; its folder is made if need be.

    Args:
        path: where to.
        schema: what it is; `load` refuses any other.
        value: a dataclass whose fields are numbers, texts, arrays, dataclasses, or tuples and
            dictionaries of these.
        effects: effects it needs; those of the user's own are written with it.
        more: further arrays, for readers that know nothing of the rest.

    Raises:
        InputError: no path, or the file cannot be written.
    """
    arrays: dict[str, Any] = {}
    text = np.array(
        json.dumps(
            {'schema': schema, 'value': _pack(value, arrays), **CATALOGUE.definitions(effects)}
        )
    )
    path = given_path(path)
    with whole_file(path) as part, part.open('wb') as file:
        np.savez_compressed(file, allow_pickle=False, **{**more, **arrays, _CONTENT: text})
    return path


def load(path: Path | str, schema: str, cls: type[T]) -> T:
    """Return what `save` wrote; registers the effects that it defines.

    Raises:
        InputError: no path, the file cannot be read, or holds something else.
    """
    path = given_path(path)
    with _opened(path, schema) as (file, content):
        if content['schema'] != schema:
            raise InputError(f'{path}: holds {content["schema"]}, not {schema}')
        if 'definitions' in content:
            CATALOGUE.define(content['definitions'], str(path))
        return typing.cast(T, _unpack(cls, content['value'], file))


def schema_of(path: Path | str) -> str:
    """Return what a file that `save` wrote holds.

    Raises:
        InputError: no path, the file cannot be read, or holds nothing of ours.
    """
    with _opened(given_path(path), 'result of actuator_glue') as (_, content):
        return str(content['schema'])


@contextmanager
def _opened(path: Path, what: str) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Yield the arrays of a file and its content, for messages called so.

    Raises:
        InputError: no file, or one that cannot be read as ours.
    """
    if not path.exists():
        raise InputError(f'{path}: there is no such file')
    # Of what is no .npz file numpy would say how to load it unsafely.
    if path.is_file() and not zipfile.is_zipfile(path):
        raise InputError(f'{path}: holds no {what}: it is no .npz file, or a damaged one')
    try:
        with np.load(path, allow_pickle=False) as file:
            yield file, json.loads(str(file[_CONTENT]))
    except InputError:
        raise
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f'{path}: holds no {what} ({error})') from error


def _pack(value: Any, arrays: dict[str, Any]) -> Any:
    if isinstance(value, np.ndarray):
        key = f'array_{len(arrays)}'
        arrays[key] = value
        return key
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _pack(getattr(value, f.name), arrays) for f in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(k): _pack(v, arrays) for k, v in value.items()}
    if isinstance(value, (tuple, list)):
        return [_pack(v, arrays) for v in value]
    return value.item() if isinstance(value, np.generic) else value


def _unpack(kind: Any, value: Any, arrays: Any) -> Any:
    if typing.get_origin(kind) is np.ndarray:
        return np.asarray(arrays[value])
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        hints = typing.get_type_hints(kind)
        return kind(**{name: _unpack(hints[name], v, arrays) for name, v in value.items()})
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        real = next(k for k in inner if k is not type(None))
        return None if value is None else _unpack(real, value, arrays)
    if origin is tuple:
        kinds = (inner[0],) * len(value) if inner[-1] is Ellipsis else inner
        return tuple(_unpack(k, v, arrays) for k, v in zip(kinds, value, strict=True))
    if origin is dict:
        return {name: _unpack(inner[1], v, arrays) for name, v in value.items()}
    return value
