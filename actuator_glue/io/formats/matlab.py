"""Variables out of MATLAB .mat files, and what objects hold of them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.file_notes import of_variable
from actuator_glue.io.formats import (
    A_REMARK,
    Column,
    FileTable,
    Format,
    matrix_column,
    matrix_columns,
    reading,
)
from actuator_glue.io.formats.hdf5 import has_objects, is_hdf5, named_by_structs, read_tree
from actuator_glue.io.matlab_elements import check_elements
from actuator_glue.io.matlab_objects import check_clocks, read_objects
from actuator_glue.io.signature import is_text, refuse_foreign
from actuator_glue.io.units import bare
from actuator_glue.records import Array

_OBJECTS = (
    'of the objects of MATLAB timeseries, tables, timetables and Datasets of Simulink are read, '
    'else save vectors'
)


def _content(path: Path) -> dict[str, Any]:
    """Return the variables of a file up to version 7."""
    from scipy.io import loadmat

    if is_text(refuse_foreign(path, 'a MATLAB .mat file')):
        raise InputError(
            f'{path}: this is text, not a MATLAB .mat file; give it a name ending in .csv'
        )
    with reading(path, 'a MATLAB .mat file'):
        check_elements(path)
        # A name that stands twice is warned of in the library's words; the last one is taken.
        with warnings.catch_warnings(action='ignore'):
            content: dict[str, Any] = loadmat(path, squeeze_me=True, struct_as_record=False)
    return content


def _collect(name: str, value: Any, arrays: dict[str, Any], texts: dict[str, str]) -> None:
    if hasattr(value, '_fieldnames'):
        for entry in value._fieldnames:
            _collect(f'{name}.{entry}', getattr(value, entry), arrays, texts)
    elif isinstance(value, str):
        texts[name] = value
    elif isinstance(value, np.ndarray) and value.dtype == object:
        # MATLAB counts down the columns.
        for i, entry in enumerate(value.ravel(order='F'), start=1):
            if hasattr(entry, '_fieldnames'):  # an array of structs; cells are left alone
                _collect(f'{name}({i})', entry, arrays, texts)
    else:
        array = np.atleast_1d(np.asarray(value))
        if array.dtype.kind in ('fiuc' if array.size > A_REMARK else 'fiu') and array.ndim <= 2:
            arrays[name] = array


def _plain(content: dict[str, Any]) -> FileTable:
    """Return the vectors and matrices of a file up to version 7."""
    arrays: dict[str, Any] = {}
    texts: dict[str, str] = {}
    for name, value in content.items():
        if not name.startswith('__'):
            _collect(name, value, arrays, texts)
    columns: list[Column] = []
    places: list[tuple[str, int]] = []
    unread: dict[str, str] = {}
    named = ((name.rpartition('.')[2], text) for name, text in texts.items())
    notes = {name: text for name, text in named if of_variable(name, text, words=True)}
    for name, array in arrays.items():
        label = name.rpartition('.')[2]
        if array.dtype.kind == 'c':
            unread[label] = 'complex numbers'
            continue
        found = matrix_columns(name, array.shape)
        columns += found
        places += [(name, i) for i in range(len(found))]
        if array.size == 1 and of_variable(label, said := repr(float(array.flat[0])), words=False):
            notes[label] = said

    def values(wanted: list[int]) -> list[Array]:
        chosen = [places[at] for at in wanted]
        return [matrix_column(arrays[n], i).astype(np.float64, copy=False) for n, i in chosen]

    return FileTable(named_by_structs(columns, texts), notes, values, unread=unread)


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    if is_hdf5(path):
        table, objects = read_tree(path, matlab=True), has_objects(path)
    else:
        content = _content(path)
        table, objects = _plain(content), '__function_workspace__' in content
    # Where vectors lie beside the objects the library for these may be missing.
    if objects and (not table.columns or find_spec('matio') is not None):
        table = _with_objects(path, table)
    if not table.columns:
        raise InputError(f'{path}: no numeric vector or matrix in this file; {_OBJECTS}')
    return table


def _with_objects(path: Path, table: FileTable) -> FileTable:
    found = read_objects(path)
    count = len(table.columns)
    # Columns outside the objects keep their labels; a second time, say, has its name in full.
    taken = {bare(column.label) for column in table.columns}
    labelled = [
        replace(e.column, label=e.column.name) if bare(e.column.label) in taken else e.column
        for e in found
    ]

    def values(wanted: list[int]) -> list[Array]:
        own = [found[at - count] for at in wanted if at >= count]
        check_clocks(path, own)
        plain = iter(table.values([at for at in wanted if at < count]))
        return [next(plain) if at < count else found[at - count].values for at in wanted]

    return FileTable([*table.columns, *labelled], table.notes, values, unread=table.unread)


def _write(path: Path, columns: Mapping[str, Array], notes: Mapping[str, str | float]) -> None:
    from scipy.io import savemat

    savemat(str(path), {**columns, **notes}, appendmat=False, do_compression=True)


FORMAT = Format(('.mat',), _read, _write, b'MATLAB ', 'a MATLAB file')
