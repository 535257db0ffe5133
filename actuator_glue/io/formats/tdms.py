"""Channels out of LabVIEW's TDMS files, read in chunks; needs npTDMS."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import Column, FileTable, Format, check_size, library, reading
from actuator_glue.records import Array

_NAME = 'a LabVIEW TDMS file'


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    tdms = library('nptdms', path).TdmsFile
    # What it warns of (a segment cut off by a killed writer) is nothing a user can act on; of text
    # that is none it prints all bytes. Its loggers have levels and a handler of their own.
    library('nptdms.log', path).log_manager.set_level(logging.CRITICAL)
    size = path.stat().st_size
    columns: list[Column] = []
    periods: set[float] = set()
    with reading(path, _NAME), tdms.open(path) as file:
        notes = {str(name): str(value) for name, value in file.properties.items()}
        for group in file.groups():
            for channel in group.channels():
                if channel.data_type is None or not _is_number(channel):
                    continue
                # A value takes a byte of the file at least: whoever says more is damaged.
                if len(channel) > size:
                    raise InputError(
                        f'{path}: damaged: {channel.path} claims {len(channel)} values'
                    )
                unit = str(channel.properties.get('unit_string', ''))
                columns.append(Column(f'{group.name}/{channel.name}', channel.name, unit))
                periods.add(float(channel.properties.get('wf_increment', 0.0)))

    def values(wanted: list[int]) -> list[Array]:
        with reading(path, _NAME), tdms.open(path) as file:
            found = {f'{g.name}/{c.name}': c for g in file.groups() for c in g.channels()}
            return [_values(found[columns[at].name], path) for at in wanted]

    if not columns:
        raise InputError(f'{path}: no channel of numbers in this TDMS file')
    # Channels of waveforms have no times of their own but a common increment.
    period = periods.pop() if len(periods) == 1 else 0.0
    return FileTable(columns, notes, values, period if period > 0.0 else None)


def _is_number(channel: Any) -> bool:
    return bool(np.dtype(channel.dtype).kind in 'fiuM')


def _values(channel: Any, path: Path) -> Array:
    """Return a channel as numbers, times as seconds; memory for it and one chunk is taken."""
    check_size(8 * len(channel), path)
    whole = np.empty(len(channel))
    for chunk in channel.data_chunks():
        part = chunk[:]
        if part.dtype.kind == 'M':
            part = part.astype('datetime64[ns]').astype(np.int64) * 1e-9
        whole[chunk.offset : chunk.offset + len(part)] = part
    return whole


FORMAT = Format(('.tdms',), _read, None, b'TDSm', _NAME)
