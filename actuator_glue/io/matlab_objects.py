"""Channels out of MATLAB's objects: timeseries, tables, Simulink's Dataset; needs mat-io.

Only what is asked for by name is taken out of an object, as its properties are its class's own
business: values and times of a timeseries, variables of a table, what else holds some of those.
Values that lie beside the objects are read elsewhere.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.formats import (
    Column,
    check_size,
    library,
    matrix_column,
    matrix_columns,
    reading,
)
from actuator_glue.records import Array

_DEEPEST = 32  # objects in objects
_NAME = 'objects of MATLAB'
# Parts of a path that say nothing: `logsout.Storage_.Elements{1}.Values` is logsout{1} to people.
_SILENT = ('Storage_', 'Storage', 'Elements', 'Elements_', 'Values')
# Where variables have names that are no identifiers: `Command [mm]`, of which `varnames` makes
# `Command_mm_`.
_OWN_NAMES = ('variablenames2048', 'varnames2048', 'variablenamesoriginal', 'varnamesorig')
_SECONDS = {
    'nanoseconds': 1e-9,
    'microseconds': 1e-6,
    'milliseconds': 1e-3,
    'seconds': 1.0,
    'minutes': 60.0,
    'hours': 3600.0,
    'days': 86400.0,
    'weeks': 604800.0,
}


@dataclass(frozen=True, slots=True, eq=False)
class ObjectColumn:
    """A column of an object.

    Attributes:
        column: its name, label and unit.
        values: shape (n,).
        times: of its samples [s], shape (n,); None where the object says none.
    """

    column: Column
    values: Array
    times: Array | None


def read_objects(path: Path) -> list[ObjectColumn]:
    """Return the columns of all objects of a file, each clock's times once.

    Args:
        path: a MATLAB file of version 7 or 7.3 that is known to be whole and of bearable size.

    Raises:
        InputError: mat-io is missing, or the objects cannot be read.
    """
    with reading(path, _NAME), warnings.catch_warnings(action='ignore'):
        content = library('matio', path).load_from_mat(str(path), raw_data=True)
        found: list[ObjectColumn] = []
        for name, value in content.items():
            if not name.startswith('__'):
                _walk(name, value, '', found, 0, path)
    return [*_clocks(found), *found]


def check_clocks(path: Path, columns: list[ObjectColumn]) -> None:
    """Refuse columns that were not sampled at the same times.

    Raises:
        InputError: two columns with times that differ.
    """
    timed = [(c.column.name, c.times) for c in columns if c.times is not None]
    for name, times in timed[1:]:
        if not np.array_equal(times, timed[0][1]):
            raise InputError(
                f'{path}: {timed[0][0]} and {name} have times of their own, '
                'and they differ; bring them to common times (`synchronize` or `resample` in '
                'MATLAB), and save them again'
            )


def _clocks(found: list[ObjectColumn]) -> list[ObjectColumn]:
    """Return the times of the columns as columns, those that several share once."""
    clocks: list[ObjectColumn] = []
    for each in found:
        times = each.times
        if times is None or any(
            np.array_equal(own, c.values) for own in (times, each.values) for c in clocks
        ):
            continue
        stem = each.column.name.rpartition('.')[0] or each.column.name
        column = Column(f'{stem}.Time', 'time' if not clocks else f'{stem}.Time', 's')
        clocks.append(ObjectColumn(column, times, times))
    return clocks


def _walk(
    name: str, value: Any, called: str, found: list[ObjectColumn], depth: int, path: Path
) -> None:
    """Take the columns under a name; `called` is the name that an enclosing object gives."""
    if depth > _DEEPEST:
        raise InputError(f'{path}: objects in objects, {depth} deep; save them one by one')
    properties = getattr(value, 'properties', None)
    if isinstance(properties, dict):
        _walk_object(name, properties, called, found, depth, path)
    elif isinstance(value, np.ndarray) and value.dtype.names:
        many = value.size > 1
        for i, entry in enumerate(value.ravel(order='F'), start=1):
            for field in value.dtype.names:
                inside = f'{name}({i}).{field}' if many else f'{name}.{field}'
                _walk(inside, entry[field], '', found, depth + 1, path)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        for i, entry in enumerate(value.ravel(order='F'), start=1):
            inside = name if value.size == 1 and '{' not in name else f'{name}{{{i}}}'
            _walk(inside, entry, called, found, depth + 1, path)


def _walk_object(
    name: str,
    properties: dict[str, Any],
    called: str,
    found: list[ObjectColumn],
    depth: int,
    path: Path,
) -> None:
    said = _text(properties.get('Name')) or _text(properties.get('PropagatedName')) or called
    data = _first(properties, 'Data_', 'Data')
    if data is not None and 'TimeInfo' in properties:
        found += _timeseries(name, properties, data, said, path)
    elif (inner := _table(properties)) is not None:
        found += _variables(name, inner)
    else:
        for key, value in properties.items():
            inside = name if key in _SILENT else f'{name}.{key.rstrip("_")}'
            _walk(inside, value, said, found, depth + 1, path)


def _timeseries(
    name: str, properties: dict[str, Any], data: Any, called: str, path: Path
) -> list[ObjectColumn]:
    """Return the columns of a timeseries; even times may be given by start and step alone."""
    info = getattr(properties['TimeInfo'], 'properties', {})
    scale = _SECONDS.get(_text(_first(info, 'Units')) or 'seconds')
    if scale is None:
        raise InputError(f'{path}: {name}: times in {_text(info.get("Units"))} are not understood')
    times = np.ravel(np.asarray(_first(properties, 'Time_', 'Time', default=()), np.float64))
    if not len(times):
        step = _number(_first(info, 'Increment_', 'Increment'))
        count = _number(_first(info, 'Length', 'Length_'))
        start = _number(_first(info, 'Start_', 'Start'))
        if not (np.isfinite(step) and np.isfinite(count)):
            return []
        times = np.nan_to_num(start) + step * np.arange(int(count), dtype=np.float64)
    unit = _first(getattr(properties.get('DataInfo'), 'properties', {}), 'Units', 'Unit_', 'Unit')
    units = getattr(unit, 'properties', None)
    unit_text = _text(_first(units, 'Name') if isinstance(units, dict) else unit)
    check_size(8 * (np.size(data) + len(times)), path)
    made = _columns(f'{name}.Data', np.asarray(data), called, unit_text)
    return [replace(c, times=scale * times) for c in made if len(c.values) == len(times)]


def _table(properties: dict[str, Any]) -> dict[str, Any] | None:
    """Return what a table or timetable holds, by lower-case names; None where it is none."""
    for inner in (properties.get('any'), properties.get('props')):
        if isinstance(inner, np.ndarray) and inner.dtype.names and inner.size == 1:
            properties = {**properties, **{n: inner.flat[0][n] for n in inner.dtype.names}}
    lower = {name.lower(): value for name, value in properties.items()}
    return lower if {'data', 'varnames'} <= set(lower) else None


def _variables(name: str, table: dict[str, Any]) -> list[ObjectColumn]:
    own = (table[n] for n in _OWN_NAMES if n in table and np.any(table.get(f'use{n}', False)))
    names = [_text(entry) for entry in np.ravel(next(own, table['varnames']))]
    units = [_text(e) for e in np.ravel(_first(table, 'varunits', 'variableunits', default=()))]
    units += [''] * (len(names) - len(units))
    times = _row_times(table)
    found = []
    for variable, unit, values in zip(names, units, np.ravel(table['data']), strict=False):
        millis = _first(getattr(values, 'properties', {}), 'millis')
        if millis is not None:
            values, unit = 1e-3 * np.asarray(millis), 's'
        if isinstance(values, np.ndarray):
            found += _columns(f'{name}.{variable}', values, variable, unit)
    if times is None:
        return found
    return [replace(c, times=times) for c in found if len(c.values) == len(times)]


def _row_times(table: dict[str, Any]) -> Array | None:
    """Return the times of a timetable [s]; datetimes count from 1970."""
    rows = table.get('rowtimes')
    inner = getattr(rows, 'properties', None)
    if isinstance(inner, dict):
        return _instants(inner)
    if not isinstance(rows, np.ndarray) or not rows.dtype.names or rows.size != 1:
        return None
    entry = rows.flat[0]
    count = int(_number(table.get('numrows')))
    origin = _instants(getattr(entry['origin'], 'properties', {}))
    step = _instants(getattr(entry['stepSize'], 'properties', {}))
    rate = _number(entry['sampleRate'])
    if bool(np.any(entry['specifiedAsRate'])) or step is None:
        step = np.array([1.0 / rate])
    first = 0.0 if origin is None else float(origin[0])
    return first + float(step[0]) * np.arange(count, dtype=np.float64)


def _instants(properties: dict[str, Any]) -> Array | None:
    """Return a duration [s], or a datetime [s since 1970], shape (n,)."""
    millis = _first(properties, 'millis', 'data')
    if millis is None or not isinstance(millis, np.ndarray) or millis.dtype.kind not in 'fiuc':
        return None
    return np.ravel(1e-3 * np.real(millis))


def _columns(name: str, values: Any, called: str, unit: str) -> list[ObjectColumn]:
    if values.dtype.kind not in 'fiu':
        return []
    columns = matrix_columns(name, values.shape, unit)
    if len(columns) == 1 and called:
        columns = [replace(columns[0], label=called)]
    return [
        ObjectColumn(column, np.asarray(matrix_column(values, i), dtype=np.float64), None)
        for i, column in enumerate(columns)
    ]


def _first(properties: Any, *names: str, default: Any = None) -> Any:
    """Return the first of some properties that is there."""
    return next((properties[n] for n in names if n in properties), default)


def _number(value: Any) -> float:
    flat = np.ravel(np.asarray(np.nan if value is None else value))
    return float(flat[0]) if len(flat) == 1 and flat.dtype.kind in 'fiub' else np.nan


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray):
        value = value.flat[0] if value.size else ''
    return value.strip() if isinstance(value, str) else ''
