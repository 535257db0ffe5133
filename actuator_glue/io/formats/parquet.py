"""Columns out of Parquet files; needs pyarrow."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import Column, FileTable, Format, check_size, library, reading
from actuator_glue.records import Array

_NAME = 'a Parquet file'


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    library('pyarrow', path)
    parquet = library('pyarrow.parquet', path)
    with reading(path, _NAME), parquet.ParquetFile(path) as file:
        schema, content = file.schema_arrow, file.metadata
        rows = content.num_rows
        # Pages are unpacked whole: what they claim counts as well as what is made of them.
        groups = [content.row_group(i).total_byte_size for i in range(content.num_row_groups)]
    notes = {
        name.decode('utf-8', 'replace'): value.decode('utf-8', 'replace')
        for name, value in (schema.metadata or {}).items()
    }
    fields = [field for field in schema if _is_number(field.type)]
    if not fields:
        raise InputError(f'{path}: no column of numbers in this Parquet file')

    def values(wanted: list[int]) -> list[Array]:
        names = [fields[at].name for at in wanted]
        check_size(max(8 * rows * len(names), *groups, 0), path)
        with reading(path, _NAME), parquet.ParquetFile(path) as file:
            table = file.read(columns=names, use_threads=False)
            return [_numbers(table.column(name)) for name in names]

    return FileTable([Column(f.name, f.name, _unit(f)) for f in fields], notes, values)


def _is_number(kind: Any) -> bool:
    import pyarrow.types as types

    return bool(types.is_floating(kind) or types.is_integer(kind) or types.is_timestamp(kind))


def _unit(field: Any) -> str:
    import pyarrow.types as types

    if types.is_timestamp(field.type):
        return 's'
    found = (field.metadata or {}).get(b'unit', b'')
    return str(found.decode('utf-8', 'replace'))


def _numbers(column: Any) -> Array:
    """Return a column as numbers, times as seconds; what is missing is NaN."""
    import pyarrow as pa

    if pa.types.is_timestamp(column.type):
        nanoseconds = column.cast(pa.timestamp('ns')).cast(pa.int64())
        return np.asarray(nanoseconds.to_numpy(), dtype=np.float64) * 1e-9
    return np.asarray(column.cast(pa.float64()).to_numpy(), dtype=np.float64)


def _write(path: Path, columns: Mapping[str, Array], notes: Mapping[str, str | float]) -> None:
    pa, parquet = library('pyarrow', path), library('pyarrow.parquet', path)
    table = pa.table({name: np.asarray(values) for name, values in columns.items()})
    noted = {name: str(value) for name, value in notes.items()}
    parquet.write_table(table.replace_schema_metadata(noted), path)


FORMAT = Format(('.parquet',), _read, _write, b'PAR1', _NAME)
