"""Channels out of LabVIEW's text measurement files (.lvm), read only.

A heading of the file, one of the measurement with an entry for each channel, names, rows. The
first column holds the times (`X_Columns One`) or nothing (`No`: `X0` and `Delta_X` say them), or
each channel has its own (`Multi`). After National Instruments' "Specification for the LabVIEW
Measurement File".
"""

from __future__ import annotations

import re
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import Column, FileTable, Format, delimited
from actuator_glue.io.formats.delimited import TextHead, entry_at, fields_of, read_columns
from actuator_glue.io.signature import open_text

_NAME = 'a LabVIEW measurement file (.lvm)'
_END = '***End_of_Header***'
_SPECIAL = ('***Start_Special***', '***End_Special***')
_SEPARATORS = {'tab': '\t', 'comma': ',', 'semicolon': ';', 'space': ' '}
_LONGEST = 1000  # lines of both headings
_TIMES, _COMMENT = 'X_Value', 'Comment'
# Seconds from LabVIEW's time zero, 1904, to that of Unix: absolute times count from the former.
_EPOCH = 2_082_844_800


class _Heading(NamedTuple):
    """What the headings say, of the file and of each channel, the names, the lines above rows."""

    file: dict[str, str]
    channels: dict[str, list[str]]
    names: list[str]
    lines: int
    delimiter: str


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    if channels is not None and channels.header_lines is not None:
        return delimited.FORMAT.read(path, channels)  # the map describes it as any other text
    said = _heading(path)
    # The last column is for comments, and left out where there are none.
    least = len(said.names) - (said.names[-1] == _COMMENT)
    head = TextHead(
        names=said.names,
        units=[''] * len(said.names),
        lines=said.lines,
        delimiter=said.delimiter,
        notes={},
        decimal=',' if said.file.get('Decimal_Separator') == ',' else '.',
        width=len(said.names),
        least=least,
        named=len(said.names),
    )
    times = [at for at in range(least) if said.names[at] == _TIMES]
    shown = [at for at in range(least) if said.names[at] != _TIMES]
    if not shown:
        raise InputError(f'{path}: no channel in {_NAME}')
    units = _of_channels(said, 'Y_Unit_Label', len(shown))
    columns = [
        Column(said.names[at], said.names[at], u) for at, u in zip(shown, units, strict=True)
    ]
    dimension = _common(path, said, 'X_Dimension', shown)
    if dimension.lower() not in ('', 'time'):
        raise InputError(f'{path}: the samples are over {dimension}, not over time')
    start_ns, period = _stamp_ns(path, said, shown), None
    if said.file.get('X_Columns', 'One').lower() == 'no':
        period = _number(path, said, 'Delta_X', shown)
        offset = _number(path, said, 'X0', shown)
        start_ns = (-_EPOCH * 10**9 if offset > _EPOCH else start_ns) + round(offset * 1e9)
    else:
        columns.insert(
            0, Column(_TIMES, 'time', _common(path, said, 'X_Unit_Label', shown) or 's')
        )
        shown.insert(0, times[0])
        first, *others = read_columns(path, head, times)
        if not all(np.array_equal(first, other) for other in others):
            raise InputError(
                f'{path}: the channels have times of their own, and they differ; bring them to '
                'common times, and save them with one X column'
            )
        if first[0] > _EPOCH:
            start_ns = -_EPOCH * 10**9
    return FileTable(
        columns,
        {},
        lambda at: read_columns(path, head, [shown[i] for i in at]),
        period,
        start_ns,
        lambda row, at: entry_at(path, head, row, shown[at]),
    )


def _heading(path: Path) -> _Heading:
    """Return what is above the rows.

    Raises:
        InputError: no names below two headings, or several measurements.
    """
    file: dict[str, str] = {}
    channels: dict[str, list[str]] = {}
    ends, lines, delimiter, special = 0, 0, '\t', False
    with open_text(path, errors='replace') as text:
        for line in islice(text, _LONGEST):
            lines += 1
            key, *entries = [entry.strip() for entry in line.split(delimiter)]
            if key == 'Separator' or re.match(r'Separator[,; ]', key):
                name = re.split(r'[\t,; ]', line)[1].strip()
                delimiter = _SEPARATORS.get(name.lower(), delimiter)
            special = (special or key == _SPECIAL[0]) and key != _SPECIAL[1]
            if key == _END:
                ends += 1
            elif ends == 2 and any((key, *entries)):
                break
            elif ends < 2 and not special and key:
                if ends == 0:
                    file[key] = entries[0] if entries else ''
                else:
                    channels[key] = entries
        else:
            raise InputError(f'{path}: no names of channels below the headings of {_NAME}')
        if file.get('Multi_Headings', 'No').lower() == 'yes' and any(
            line.startswith(_END) for line in text
        ):
            raise InputError(
                f'{path}: several measurements, each with a heading, in one file; save each as a '
                'file of its own, or with one heading only'
            )
    names = fields_of(line, delimiter)
    while names and not names[-1]:
        names.pop()
    return _Heading(file, channels, names, lines, delimiter)


def _of_channels(said: _Heading, name: str, count: int) -> list[str]:
    """Return what a heading says of each channel."""
    entries = said.channels.get(name, [])
    filled = [entry for entry in entries if entry]
    # Where each channel has a column of times there are empty entries between.
    return filled if len(filled) == count else [*entries, *[''] * count][:count]


def _common(path: Path, said: _Heading, name: str, shown: list[int]) -> str:
    """Return what a heading says of all channels alike.

    Raises:
        InputError: not the same of all.
    """
    found = set(_of_channels(said, name, len(shown))) - {''}
    if len(found) > 1:
        raise InputError(
            f'{path}: {name} differs between channels ({", ".join(sorted(found))}); save those of '
            'one clock as a file of their own'
        )
    return found.pop() if found else ''


def _number(path: Path, said: _Heading, name: str, shown: list[int]) -> float:
    text = _common(path, said, name, shown)
    try:
        value = float(text.replace(',', '.'))
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f'{path}: {name} is {text!r}, but there is no column of times')
    return value


def _stamp_ns(path: Path, said: _Heading, shown: list[int]) -> int:
    """Return the date and time of the measurement [ns], taken as UTC: no zone is written."""
    date = _common(path, said, 'Date', shown) or said.file.get('Date', '')
    clock = _common(path, said, 'Time', shown) or said.file.get('Time', '')
    numbers = re.fullmatch(
        r'(\d{4})/(\d+)/(\d+) (\d+):(\d+):(\d+)(?:[.,](\d*))?', f'{date} {clock}'
    )
    if numbers is None:
        return 0
    *parts, fraction = numbers.groups()
    try:
        year, month, day, hour, minute, second = map(int, parts)
        whole = datetime(year, month, day, hour, minute, second, tzinfo=UTC).timestamp()
    except ValueError:
        return 0
    return round(whole) * 10**9 + int(f'{fraction or ""}000000000'[:9])


FORMAT = Format(('.lvm',), _read, None, b'LabVIEW Measurement', _NAME, text=True)
