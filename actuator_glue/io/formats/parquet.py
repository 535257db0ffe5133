"""Columns out of Parquet files; needs pyarrow."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_attributes import scaling, unit_of
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import Column, FileTable, Format, check_size, library, reading
from actuator_glue.io.units import bare
from actuator_glue.records import Array

_NAME = 'a Parquet file'


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    library('pyarrow', path)
    parquet = library('pyarrow.parquet', path)
    with reading(path, _NAME), parquet.ParquetFile(path) as file:
        schema, content = file.schema_arrow, file.metadata
        rows = content.num_rows
        # Pages are unpacked whole: their claimed size counts as well as that of the numbers.
        groups = [content.row_group(i) for i in range(content.num_row_groups)]
        claimed = max((group.total_byte_size for group in groups), default=0)
        told = [group.num_rows for group in groups]
    if sum(told) != rows or min(told, default=0) < 0:
        # Pyarrow makes room for what a group claims, terabytes if need be.
        raise InputError(
            f'{path}: {rows} rows in all, but its {len(told)} row groups hold {sum(told)}: this '
            'Parquet file is damaged; copy it again from where it was written'
        )
    notes = _notes(_texts(schema.metadata))
    # Columns may share a name: each is the first, the second of it.
    seen: Counter[str] = Counter()
    fields, places = [], []
    for field in schema:
        if _is_number(field.type):
            fields.append(field)
            places.append(seen[field.name])
        seen[field.name] += 1
    if not fields:
        raise InputError(f'{path}: no column of numbers in this Parquet file')

    def values(wanted: list[int]) -> list[Array]:
        names = [fields[at].name for at in wanted]
        check_size(max(8 * rows * len(names), claimed), path)
        with reading(path, _NAME), parquet.ParquetFile(path) as file:
            table = file.read(columns=[*dict.fromkeys(names)], use_threads=False)
            firsts = [table.column_names.index(name) for name in names]
            return [
                _numbers(table.column(first + places[at]))
                for first, at in zip(firsts, wanted, strict=True)
            ]

    unread = {f.name: str(f.type) for f in schema if not _is_number(f.type)}
    # A column of nothing has no type.
    unread = {name: kind for name, kind in unread.items() if kind != 'null'}
    return FileTable([_column(f) for f in fields], notes, values, unread=unread)


def _notes(metadata: dict[str, str]) -> dict[str, str]:
    """Return what a file says besides: its own metadata, and `DataFrame.attrs` of pandas."""
    with suppress(ValueError, AttributeError):  # whatever else stands under that name
        attributes = json.loads(metadata.get('PANDAS_ATTRS', '{}'))
        metadata = {name: str(value) for name, value in attributes.items()} | metadata
    return metadata


def _is_number(kind: Any) -> bool:
    import pyarrow.types as types

    return bool(
        types.is_floating(kind) or types.is_integer(kind) or types.is_decimal(kind)
    ) or _is_time(kind)


def _is_time(kind: Any) -> bool:
    import pyarrow.types as types

    return bool(types.is_timestamp(kind) or types.is_duration(kind) or types.is_time(kind))


def _column(field: Any) -> Column:
    if _is_time(field.type):
        # Its type says its unit, whatever `time_ns` may say.
        return Column(field.name, bare(field.name), 's')
    said = _texts(field.metadata)
    return Column(field.name, field.name, unit_of(said), scaling(said))


def _texts(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    return {
        name.decode('utf-8', 'replace'): value.decode('utf-8', 'replace')
        for name, value in (metadata or {}).items()
    }


def _numbers(column: Any) -> Array:
    """Return a column as numbers, times as seconds; what is missing is NaN."""
    import pyarrow as pa

    kind = column.type
    if not _is_time(kind):
        # Whole numbers beyond 2^53 are rounded: those of nanoseconds to a quarter of a thousand.
        return np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
    ticks = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9}[kind.unit]
    whole = pa.int32() if kind.bit_width == 32 else pa.int64()
    return np.asarray(column.cast(whole).to_numpy(), dtype=np.float64) * ticks


def _write(path: Path, columns: Mapping[str, Array], notes: Mapping[str, str | float]) -> None:
    pa, parquet = library('pyarrow', path), library('pyarrow.parquet', path)
    table = pa.table({name: np.asarray(values) for name, values in columns.items()})
    noted = {name: str(value) for name, value in notes.items()}
    parquet.write_table(table.replace_schema_metadata(noted), path)


FORMAT = Format(('.parquet',), _read, _write, b'PAR1', _NAME)
