"""Datasets out of HDF5 files, MATLAB's version 7.3 included; needs h5py."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_attributes import UNIT_NAMES, plain_text, scaling, unit_of
from actuator_glue.io.channel_map import MOST_COLUMNS, ChannelMap
from actuator_glue.io.file_notes import nearly, of_groups, of_variable
from actuator_glue.io.formats import (
    A_REMARK,
    Column,
    FileTable,
    Format,
    check_size,
    library,
    matrix_column,
    matrix_columns,
    reading,
)
from actuator_glue.io.signature import beginning
from actuator_glue.io.waveforms import (
    PROPERTIES,
    WaveformClock,
    asked_for,
    common_clock,
    of_properties,
)
from actuator_glue.records import Array

_MAGIC = b'\x89HDF\r\n\x1a\n'
_PACKED = 1100  # bytes into which deflate expands one byte at most, rounded up from 1032
_CLASS, _EMPTY, _OBJECT = 'MATLAB_class', 'MATLAB_empty', 'MATLAB_object_decode'
_DEEPEST, _MOST_STRUCTS = 64, 10_000  # structs in structs, and in all
# Fields of a struct that hold samples, and those beside them that hold their name.
_FIELDS = ('data', 'values', 'value')
_NAMES = ('name', 'label')
_NAME = 'an HDF5 file'
_PACKING = ('scale_factor', 'add_offset')  # of netCDF, and applied


def is_hdf5(path: Path) -> bool:
    """Return whether a file is HDF5, at its beginning or behind MATLAB's 512 bytes of text."""
    start = beginning(path)
    return _MAGIC in (start[: len(_MAGIC)], start[512 : 512 + len(_MAGIC)])


def read_tree(
    path: Path, channels: ChannelMap | None = None, *, matlab: bool = False
) -> FileTable:
    """Return the numeric datasets of a file as a table.

    Args:
        path: the file.
        channels: a map that says which columns are asked for; None for those called by a role.
        matlab: names with dots, matrices turned as MATLAB has them; there may be objects alone,
            and no column.

    Raises:
        InputError: h5py is missing, the file is damaged or holds no numbers.
    """
    h5py = library('h5py', path)
    tree = _Tree(matlab)

    def values(wanted: list[int]) -> list[Array]:
        with reading(path, _NAME), h5py.File(path, 'r') as file:
            chosen = [tree.places[at] for at in wanted]
            read = [_values(file[name], part, path) for name, part in chosen]
        return [column[cuts.get(at, slice(None))] for at, column in zip(wanted, read, strict=True)]

    with reading(path, _NAME), h5py.File(path, 'r') as file:
        file.visititems(tree.visit)
        notes, told = of_groups(tree.groups)
        tree.notes = notes | tree.notes
        tree.notes |= {n: plain_text(file.attrs[n]) for n in file.attrs if nearly(n)}
    if not tree.columns and not matlab:
        raise InputError(f'{path}: no numeric vector or matrix in this file')
    columns = named_by_structs(tree.columns, tree.texts)
    cuts, period, start_ns = common_clock(tree.clocks, asked_for(columns, channels), path)
    return FileTable(columns, tree.notes, values, period, start_ns, unread=tree.unread, told=told)


def has_objects(path: Path) -> bool:
    """Return whether a file of MATLAB holds objects, after a look at how much it unpacks to.

    Raises:
        InputError: more numbers than are read, or than such a file can hold.
    """
    h5py = library('h5py', path)
    with reading(path, _NAME), h5py.File(path, 'r') as file:
        if '#subsystem#' not in file:
            return False
        sizes: list[int] = []
        file.visititems(lambda _, found: sizes.append(getattr(found, 'nbytes', 0)))
    check_size(sum(sizes), path)
    if sum(sizes) > _PACKED * path.stat().st_size:
        raise InputError(f'{path}: damaged: more numbers than a file of this size can hold')
    return True


class _Tree:
    """Content of a file, collected as its datasets are visited.

    Attributes:
        columns: names of the columns of numbers.
        places: dataset of each column, and which column or field of that.
        clocks: of each column, as npTDMS writes those of waveforms beside their samples.
        notes: what the file says besides.
        groups: what each group and dataset says in its attributes.
        texts: small texts by their names in full.
        unread: columns of what is no number, by their label, and what they hold.
    """

    def __init__(self, matlab: bool) -> None:
        self._matlab = matlab
        self.columns: list[Column] = []
        self.places: list[tuple[str, str | int]] = []
        self.clocks: list[WaveformClock] = []
        self.notes: dict[str, str] = {}
        self.groups: list[dict[str, str]] = []
        self.texts: dict[str, str] = {}
        self.unread: dict[str, str] = {}
        self._seen = 0

    def visit(self, name: str, found: Any) -> None:
        """Take what lies under a name; MATLAB's own group `#refs#` is left out."""
        self.groups.append({n: plain_text(found.attrs[n]) for n in found.attrs if nearly(n)})
        if not name.startswith('#') and hasattr(found, 'shape'):
            self._take(name, found, name.replace('/', '.') if self._matlab else name, 0)

    def _take(self, place: str, dataset: Any, shown: str, depth: int) -> None:
        # Links to other files are never followed, external storage is never opened.
        if dataset.is_virtual or dataset.external or len(self.columns) > MOST_COLUMNS:
            return
        if dataset.shape is None or _EMPTY in dataset.attrs:
            return  # what MATLAB stores of [] is its shape
        if dataset.size <= 1000:
            self._note(dataset, shown)
        if not dataset.shape:
            return
        fields = dataset.dtype.names
        if self._matlab and 'ref' in (dataset.dtype.metadata or {}):
            few = dataset.size <= MOST_COLUMNS and depth < _DEEPEST
            if few and _CLASS not in dataset.attrs:  # cells are left alone
                self._take_structs(dataset, shown, depth + 1)
        elif fields and dataset.ndim == 1:  # a table: one column per field
            others = [f for f in fields if dataset.dtype[f].kind not in 'fiu']
            if dataset.size > A_REMARK:
                self.unread |= {f: _kind(dataset.dtype[f]) for f in others}
            fields = [f for f in fields if f not in others]
            said = scaling(dataset.attrs)
            self.columns += [Column(f'{shown}.{f}', f, '', said) for f in fields]
            self.places += [(place, f) for f in fields]
            self.clocks += [_clock(f, dataset) for f in fields]
        elif dataset.dtype.kind in 'fiu' and not (_is_text(dataset) or _OBJECT in dataset.attrs):
            shape = dataset.shape[::-1] if self._matlab else dataset.shape
            said = scaling(dataset.attrs, _PACKING)
            found = matrix_columns(shown, shape, unit_of(dataset.attrs), said)
            self.columns += found
            self.places += [(place, i) for i in range(len(found))]
            self.clocks += [_clock(column.name, dataset) for column in found]
        elif dataset.size > A_REMARK and (fields or _CLASS not in dataset.attrs):
            self.unread[shown.replace('/', '.').rpartition('.')[2]] = _kind(dataset.dtype)

    def _note(self, dataset: Any, shown: str) -> None:
        label = shown.replace('/', '.').rpartition('.')[2]
        words = _is_text(dataset) or dataset.dtype.kind in 'SUO'
        if not (words or dataset.size == 1):
            return
        said = _text(dataset)
        if of_variable(label, said, words=words):
            self.notes[label] = said
        if _is_text(dataset):
            self.texts[shown] = said

    def _take_structs(self, dataset: Any, shown: str, depth: int) -> None:
        """Take a field of an array of structs: a reference for each, in MATLAB's order."""
        structs, _, field = shown.rpartition('.')
        self._seen += dataset.size
        if self._seen > _MOST_STRUCTS:
            raise InputError(f'{dataset.file.filename}: more than {_MOST_STRUCTS} structs')
        for i, reference in enumerate(dataset[()].flat, start=1):
            if not reference:
                continue
            target: Any = dataset.file[reference]
            called = f'{structs}({i}).{field}'
            if hasattr(target, 'shape'):
                self._take(target.name, target, called, depth)
                continue
            for name, within in _datasets(target):
                self._take(within.name, within, f'{called}.{name}', depth)


def _clock(name: str, dataset: Any) -> WaveformClock:
    """Return the clock of a column; properties of other kinds than npTDMS writes are none."""
    said: dict[str, Any] = {}
    for key in [key for key in PROPERTIES if key in dataset.attrs]:
        value = dataset.attrs[key]
        if key != 'wf_start_time':
            said |= {key: value} if isinstance(value, (int, float, np.number)) else {}
            continue
        with suppress(ValueError):
            said[key] = np.datetime64(plain_text(value).removesuffix('Z'), 'us')
    return of_properties(name, said, max(dataset.shape))


def _kind(dtype: np.dtype[Any]) -> str:
    """Return what is held that is no number, in words."""
    if dtype.kind in 'SUO':
        return 'text'
    return 'complex numbers' if dtype.kind == 'c' or 'imag' in (dtype.names or ()) else str(dtype)


def _datasets(group: Any) -> list[tuple[str, Any]]:
    """Return the datasets in a group and its groups, with MATLAB's names from the group on."""
    found: list[tuple[str, Any]] = []

    def keep(name: str, within: Any) -> None:
        if hasattr(within, 'shape') and len(found) < MOST_COLUMNS:
            found.append((name.replace('/', '.'), within))

    group.visititems(keep)
    return found


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
    if len(set(dataset.shape)) == 1 and dataset.ndim == 2 and _CLASS in dataset.attrs:
        return _unpacked(dataset[part, :], dataset.attrs)  # a square, turned in the file
    return _unpacked(matrix_column(dataset, part), dataset.attrs)


def named_by_structs(columns: list[Column], texts: dict[str, str]) -> list[Column]:
    """Return columns with the names and units that lie beside them, as in `Y(1).Name`.

    Args:
        columns: of the structs' vectors, e.g. `Y(1).Data`.
        texts: all texts of the file by their names in full.
    """
    told = {name.lower(): text.strip() for name, text in texts.items()}
    out = []
    for column in columns:
        struct, _, field = column.name.rpartition('.')
        if struct and field.lower() in _FIELDS:
            label = next(filter(None, (told.get(f'{struct}.{n}'.lower()) for n in _NAMES)), '')
            unit = next(filter(None, (told.get(f'{struct}.{n}'.lower()) for n in UNIT_NAMES)), '')
            column = replace(column, label=label or column.label, unit=column.unit or unit)
        out.append(column)
    return out


def _unpacked(values: Any, attributes: Any) -> Array:
    """Return numbers as netCDF packs them (CF conventions, section 8.1); what is missing is NaN.

    Raises:
        ValueError: a factor or a fill value that is no number.
    """
    if plain_text(attributes.get('_Unsigned', '')).lower() == 'true' and values.dtype.kind == 'i':
        values = values.view(values.dtype.str.replace('i', 'u'))
    missing = np.zeros(values.shape, dtype=bool)
    for name in ('_FillValue', 'missing_value'):
        for mark in np.ravel(attributes.get(name, ())):
            missing |= values == np.asarray(mark).astype(values.dtype)
    lowest, highest = _valid(attributes, values.dtype)
    missing |= (values < lowest) | (values > highest)
    unpacked = np.asarray(values, dtype=np.float64)
    scale, offset = (attributes.get(name) for name in _PACKING)
    if scale is not None:
        unpacked = unpacked * float(np.ravel(scale)[0])
    if offset is not None:
        unpacked = unpacked + float(np.ravel(offset)[0])
    return np.where(missing, np.nan, unpacked) if missing.any() else unpacked


def _valid(attributes: Any, kind: np.dtype[Any]) -> tuple[float, float]:
    """Return the least and the greatest packed value that is not missing."""
    least, most = -np.inf, np.inf
    if 'valid_range' in attributes:
        least, most = (float(v) for v in np.asarray(attributes['valid_range']).astype(kind))
    if 'valid_min' in attributes:
        least = float(np.ravel(attributes['valid_min']).astype(kind)[0])
    if 'valid_max' in attributes:
        most = float(np.ravel(attributes['valid_max']).astype(kind)[0])
    return least, most


def _is_text(dataset: Any) -> bool:
    return bool(plain_text(dataset.attrs.get(_CLASS, '')) == 'char')


def _text(dataset: Any) -> str:
    """Return a small dataset as text: characters of MATLAB, a string, or a number."""
    values = dataset[()]
    if _is_text(dataset):
        return ''.join(chr(c) for c in values.flat)
    return plain_text(np.asarray(values).flat[0])


def _write(path: Path, columns: Mapping[str, Array], notes: Mapping[str, str | float]) -> None:
    with library('h5py', path).File(path, 'w') as file:
        for name, values in columns.items():
            file[name] = values
        file.attrs.update(notes)


FORMAT = Format(('.h5', '.hdf5'), read_tree, _write, _MAGIC, _NAME)
