"""Datasets out of HDF5 files, MATLAB's version 7.3 included; needs h5py."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import (
    MOST_COLUMNS,
    Column,
    FileTable,
    Format,
    check_size,
    library,
    matrix_column,
    matrix_columns,
    reading,
)
from actuator_glue.records import Array

_MAGIC = b'\x89HDF\r\n\x1a\n'
_PACKED = 1100  # bytes out of one that deflate makes at most (1032), nearly
_OBJECT = 'MATLAB_object_decode'
_NAME = 'an HDF5 file'
_UNITS = ('unit', 'units', 'Unit', 'Units')
_NOTES = ('stiffness_N_per_m', 'hold', 'actuator')
OBJECTS = (
    'tables, timeseries and other objects of MATLAB open nowhere else; save vectors or structs '
    'of vectors'
)


def is_hdf5(path: Path) -> bool:
    """Return whether a file is HDF5, at its beginning or behind MATLAB's 512 bytes of text."""
    try:
        with path.open('rb') as file:
            start = file.read(512 + len(_MAGIC))
    except OSError:
        return False
    return start.startswith(_MAGIC) or start[512:] == _MAGIC


def read_tree(path: Path, *, matlab: bool = False) -> FileTable:
    """Return the numeric datasets of a file as a table.

    Args:
        path: the file.
        matlab: names with dots, matrices turned as MATLAB has them.

    Raises:
        InputError: h5py is missing, the file is damaged or holds no numbers.
    """
    h5py = library('h5py', path)
    columns: list[Column] = []
    places: list[tuple[str, str | int]] = []
    notes: dict[str, str] = {}

    def take(name: str, dataset: Any) -> None:
        # Links to other files are never followed, external storage is never opened.
        if not isinstance(dataset, h5py.Dataset) or name.startswith('#') or not dataset.shape:
            return
        if dataset.is_virtual or dataset.external or len(columns) > MOST_COLUMNS:
            return
        shown = name.replace('/', '.') if matlab else name
        label = shown.replace('/', '.').rpartition('.')[2]
        if label in _NOTES and dataset.size <= 1000:
            notes[label] = _text(dataset)
        if dataset.dtype.names and dataset.ndim == 1:  # a table: one column per field
            fields = [f for f in dataset.dtype.names if dataset.dtype[f].kind in 'fiu']
            columns.extend(Column(f'{shown}.{f}', f) for f in fields)
            places.extend((name, f) for f in fields)
        elif dataset.dtype.kind in 'fiu' and not (_is_text(dataset) or _OBJECT in dataset.attrs):
            shape = dataset.shape[::-1] if matlab else dataset.shape
            found = matrix_columns(shown, shape, _unit(dataset))
            columns.extend(found)
            places.extend((name, i) for i in range(len(found)))

    def values(wanted: list[int]) -> list[Array]:
        with reading(path, _NAME), h5py.File(path, 'r') as file:
            chosen = [places[at] for at in wanted]
            return [_values(file[name], part, path) for name, part in chosen]

    with reading(path, _NAME), h5py.File(path, 'r') as file:
        notes |= {n: _plain(file.attrs[n]) for n in _NOTES if n in file.attrs}
        file.visititems(take)
    if not columns:
        hint = f'; {OBJECTS}' if matlab else ''
        raise InputError(f'{path}: no numeric vector or matrix in this file{hint}')
    return FileTable(columns, notes, values)


def _values(dataset: Any, part: str | int, path: Path) -> Array:
    """Return a field of a table, or a column of a vector or matrix."""
    check_size(dataset.size * max(dataset.dtype.itemsize, 8), path)
    if dataset.nbytes > _PACKED * path.stat().st_size:
        raise InputError(
            f'{path}: damaged: {dataset.name} says that it has {dataset.nbytes / 1e6:.3g} MB of '
            'numbers, more than a file of this size can hold'
        )
    if isinstance(part, str):
        return np.asarray(dataset.fields(part)[:], dtype=np.float64)
    if len(set(dataset.shape)) == 1 and dataset.ndim == 2 and 'MATLAB_class' in dataset.attrs:
        return np.asarray(dataset[part, :], dtype=np.float64)  # a square, turned in the file
    return np.asarray(matrix_column(dataset, part), dtype=np.float64)


def _is_text(dataset: Any) -> bool:
    return bool(_plain(dataset.attrs.get('MATLAB_class', '')) == 'char')


def _text(dataset: Any) -> str:
    """Return a small dataset as text: characters of MATLAB, a string, or a number."""
    values = dataset[()]
    if _is_text(dataset):
        return ''.join(chr(c) for c in values.flat)
    return _plain(np.asarray(values).flat[0])


def _plain(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode('utf-8', 'replace')
    return repr(float(value)) if isinstance(value, np.number) else str(value)


def _unit(dataset: Any) -> str:
    found = [_plain(dataset.attrs[name]) for name in _UNITS if name in dataset.attrs]
    return found[0] if found else ''


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    return read_tree(path)


def _write(path: Path, columns: Mapping[str, Array], notes: Mapping[str, str | float]) -> None:
    with library('h5py', path).File(path, 'w') as file:
        for name, values in columns.items():
            file[name] = values
        file.attrs.update(notes)


FORMAT = Format(('.h5', '.hdf5'), _read, _write, _MAGIC, _NAME)
