"""Channels out of LabVIEW's text measurement files (.lvm), read only.

A heading of the file, one of the measurement with an entry for each channel, names, rows. The
first column holds the times (`X_Columns One`) or nothing (`No`: `X0` and `Delta_X` say them), or
each channel has its own (`Multi`). After National Instruments' "Specification for the LabVIEW
Measurement File".
"""

from __future__ import annotations

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from actuator_glue.clock_check import APART, rate_by_clock
from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import Column, FileTable, Format, delimited
from actuator_glue.io.formats.delimited import TextHead, entry_at, fields_of, read_columns
from actuator_glue.io.signature import open_text
from actuator_glue.io.units import ROLES
from actuator_glue.records import Array

_NAME = 'a LabVIEW measurement file (.lvm)'
_END = '***End_of_Header***'
_SPECIAL = ('***Start_Special***', '***End_Special***')
_SEPARATORS = {'tab': '\t', 'comma': ',', 'semicolon': ';', 'space': ' '}
_LONGEST = 1000  # lines of both headings
# What begins a heading below the rows of another: of an appended file, of a segment.
_BEGINS = ('LabVIEW Measurement', 'Channels', _SPECIAL[0])
_TIMES, _COMMENT = 'X_Value', 'Comment'
# Lines of a heading with an entry for each channel.
_EACH = ('Samples', 'Date', 'Time', 'Y_Unit_Label', 'X_Dimension', 'X0', 'Delta_X')
# Seconds from LabVIEW's time zero, 1904, to that of Unix: absolute times count from the former.
_EPOCH = 2_082_844_800


class _HeadedRows(NamedTuple):
    """Rows below a heading: what it says of each channel, the names, the lines above, how many."""

    channels: dict[str, list[str]]
    names: list[str]
    lines: int
    rows: int


class _Heading(NamedTuple):
    """What the heading of the file says, what parts its entries, and the segments below it."""

    file: dict[str, str]
    delimiter: str
    segments: list[_HeadedRows]


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    if channels is not None and channels.header_lines is not None:
        return delimited.FORMAT.read(path, channels)  # the map describes it as any other text
    said = _heading(path)
    names = said.segments[0].names
    heads = [_head(said, segment) for segment in said.segments]
    least = heads[0].least
    times = [at for at in range(least) if names[at] == _TIMES]
    shown = [at for at in range(least) if names[at] != _TIMES]
    if not shown:
        raise InputError(f'{path}: no channel in {_NAME}')
    units = [_of_channels(segment, 'Y_Unit_Label', shown) for segment in said.segments]
    if any(s.names != names or u != units[0] for s, u in zip(said.segments, units, strict=True)):
        raise InputError(
            f'{path}: several measurements of different channels in one file; save each as a '
            'file of its own'
        )
    columns = [Column(names[at], names[at], u) for at, u in zip(shown, units[0], strict=True)]
    for segment in said.segments:
        dimension = _common(path, segment, 'X_Dimension', shown)
        if dimension.lower() not in ('', 'time'):
            raise InputError(f'{path}: the samples are over {dimension}, not over time')

    def values(at: list[int]) -> list[Array]:
        parts = [read_columns(path, head, at) for head in heads]
        return (
            parts[0] if len(parts) == 1 else [np.concatenate(c) for c in zip(*parts, strict=True)]
        )

    counted = said.file.get('X_Columns', 'One').lower() == 'no'
    unit = 's' if counted else _common(path, said.segments[0], 'X_Unit_Label', shown) or 's'
    clocks = [_clock(path, said, i, heads[i], times, shown) for i in range(len(heads))]
    start_ns, period, clock = clocks[0].start_ns, None, clocks[0].times
    places: list[int | None] = [*shown]
    if counted and len(clocks) == 1:
        period = _number(path, said.segments[0], 'Delta_X', shown)
        start_ns += round(float(clock[0]) * 1e9)
    else:
        clock = _joined(path, clocks, ROLES['time'].get(unit, 1.0))
        columns, places = [Column(_TIMES, 'time', unit), *columns], [None, *shown]

    def with_times(at: list[int]) -> list[Array]:
        read = iter(values([place for i in at if (place := places[i]) is not None] or shown[:1]))
        return [clock if places[i] is None else next(read) for i in at]

    def entry(row: int, at: int) -> str:
        place, part = places[at], 0
        while part < len(heads) - 1 and row >= said.segments[part].rows:
            row -= said.segments[part].rows
            part += 1
        return entry_at(path, heads[part], row, (times or shown)[0] if place is None else place)

    told = tuple(dict.fromkeys(c.told for c in clocks if c.told))
    return FileTable(columns, {}, with_times, period, start_ns, entry, told=told)


class _SegmentTimes(NamedTuple):
    """Times of a segment, in the unit of the file, and the time from which they count [ns].

    And what a reader should know of them. The start is 0 where no date says it.
    """

    times: Array
    start_ns: int
    told: str


def _clock(
    path: Path, said: _Heading, number: int, head: TextHead, times: list[int], shown: list[int]
) -> _SegmentTimes:
    segment, told = said.segments[number], ''
    _check_count(path, segment, shown)
    if said.file.get('X_Columns', 'One').lower() == 'no':
        period = _number(path, segment, 'Delta_X', shown)
        first = _number(path, segment, 'X0', shown)
        own = first + period * np.arange(segment.rows, dtype=np.float64)
    elif not times:
        raise InputError(
            f'{path}: X_Columns is {said.file.get("X_Columns", "One")}, but no column is called '
            f'{_TIMES}; name the column of times so, or save the file anew'
        )
    else:
        own, *others = read_columns(path, head, times)
        if not all(np.array_equal(own, other) for other in others):
            raise InputError(
                f'{path}: the channels have times of their own, and they differ; bring them to '
                'common times, and save them with one X column'
            )
        told = _checked_clock(path, said, segment, shown, own)
    if own[0] > _EPOCH:
        return _SegmentTimes(own, -_EPOCH * 10**9, told)
    return _SegmentTimes(own, _stamp_ns(path, said, segment, shown), told)


def _check_count(path: Path, segment: _HeadedRows, shown: list[int]) -> None:
    """Refuse rows of which the last are missing; more than are said are appended ones.

    Raises:
        InputError: fewer than the heading says.
    """
    stated = [int(n) for n in _of_channels(segment, 'Samples', shown) if n.isdecimal()]
    if stated and segment.rows < max(stated):
        raise InputError(
            f'{path}: Samples is {max(stated)}, and {segment.rows} rows follow: the file is cut '
            'off; copy it anew, or mend that line if all is there'
        )


def _checked_clock(
    path: Path, said: _Heading, segment: _HeadedRows, shown: list[int], times: Array
) -> str:
    """Refuse a column of times that the heading contradicts; return in words where rows are few.

    A heading of single samples, or of the first rows of many in one X column, says nothing of
    the step: LabVIEW writes a `Delta_X` of 1 there. Where samples were decimated it is that of
    all, and the rows go up by a whole multiple of it.

    Raises:
        InputError: Delta_X is another step, or channels of one column begin at different times.
    """
    one = said.file.get('X_Columns', 'One').lower() == 'one'
    counts = [int(n) for n in _of_channels(segment, 'Samples', shown) if n.isdecimal()]
    if counts and (max(counts) <= 1 or (one and segment.rows > max(counts))):
        return ''
    spacing = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    for name in ('Delta_X', 'X0') if one else ():
        found = [value for _, value in _numbers(segment, name, shown)]
        allowed = abs(spacing) if name == 'X0' else APART * max(found, default=0.0)
        if max(found, default=0.0) - min(found, default=0.0) > allowed * (1.0 + 1e-6):
            _common(path, segment, name, shown)
    for text, step in set(_numbers(segment, 'Delta_X', shown)):
        # In units of steps: the comparison wants two seconds of any rate.
        rate = rate_by_clock(np.arange(len(times)), times / step, 1.0) if step > 0.0 else None
        if rate is None:
            continue
        kept = round(1.0 / rate)  # of so many samples, one
        decimated = kept > 1 and abs(1.0 / rate - kept) <= APART * kept
        if not decimated and abs(step / rate - step) > _rounded(text):
            raise InputError(
                f'{path}: Delta_X is {text}, but {_TIMES} goes up by {step / rate:.6g}; mend the '
                'one that is wrong'
            )
        if decimated:
            return (
                f'{_TIMES} goes up by {kept} times Delta_X ({text}): of {kept} samples one was '
                'kept. If what comes between was not filtered out before, faster motion is in '
                'these samples as slower one (aliasing)'
            )
    return ''


def _numbers(segment: _HeadedRows, name: str, shown: list[int]) -> list[tuple[str, float]]:
    """Return the numbers that a heading says of channels, as they are written and as they are."""
    found = []
    for text in _of_channels(segment, name, shown):
        try:
            value = float(text.replace(',', '.'))
        except ValueError:
            continue
        if np.isfinite(value):
            found.append((text, value))
    return found


def _rounded(text: str) -> float:
    """Return how far a number may be from the one that it was rounded from."""
    digits, _, power = text.lower().replace(',', '.').partition('e')
    return 0.5 * 10.0 ** (int(power or 0) - len(digits.partition('.')[2]))


def _joined(path: Path, clocks: list[_SegmentTimes], scale: float) -> Array:
    """Return the times of all segments, of so many seconds a unit.

    Those that begin again are later by their dates.

    Raises:
        InputError: times that begin again, and no date that says when.
    """
    parts = [clocks[0].times]
    for clock in clocks[1:]:
        times = clock.times
        if times[0] <= parts[-1][-1]:
            if clock.start_ns <= 0 or clocks[0].start_ns <= 0:
                raise InputError(
                    f'{path}: several measurements in one file, each with times from its own '
                    'start, and no date says when that was; save each as a file of its own'
                )
            times = times + (clock.start_ns - clocks[0].start_ns) * 1e-9 / scale
        parts.append(times)
    return np.concatenate(parts) if len(parts) > 1 else parts[0]


def _head(said: _Heading, segment: _HeadedRows) -> TextHead:
    names = segment.names
    return TextHead(
        names=names,
        units=[''] * len(names),
        lines=segment.lines,
        delimiter=said.delimiter,
        notes={},
        decimal=',' if said.file.get('Decimal_Separator') == ',' else '.',
        width=len(names),
        # The last column is for comments, and left out where there are none.
        least=len(names) - (names[-1] == _COMMENT),
        named=len(names),
        rows=segment.rows if len(said.segments) > 1 else None,
    )


def _heading(path: Path) -> _Heading:
    """Return what is above the rows, and where the rows of each segment are.

    LabVIEW writes a heading for each segment where it is told so, and that of the file again
    where it appends to one.

    Raises:
        InputError: no names below two headings, or no rows below them.
    """
    file: dict[str, str] = {}
    segments: list[_HeadedRows] = []
    channels: dict[str, list[str]] = {}
    names: list[str] = []
    inside, delimiter, special, waiting, first, rows = 'file', '\t', False, 0, 0, 0
    with open_text(path, errors='replace') as text:
        for at, line in enumerate(text, start=1):
            if inside == 'rows' and not line.startswith(_BEGINS):
                rows += bool(line.strip())
                continue
            if inside == 'rows':
                segments.append(_HeadedRows(channels, names, first, rows))
                channels, rows, waiting = {}, 0, 0
                inside = 'file' if line.startswith(_BEGINS[0]) else 'segment'
            waiting += 1
            if waiting > _LONGEST:
                break
            key, *entries = [entry.strip() for entry in line.split(delimiter)]
            if inside == 'file' and (key == 'Separator' or re.match(r'Separator[,; ]', key)):
                name = ''.join(re.split(r'[\t,; ]', line)[1:2]).strip()
                delimiter = _SEPARATORS.get(name.lower(), delimiter)
            special = (special or key == _SPECIAL[0]) and key != _SPECIAL[1]
            if key == _END:
                inside = 'segment' if inside == 'file' else 'names'
            elif inside == 'names' and any((key, *entries)):
                names, first, inside = fields_of(line, delimiter), at, 'rows'
                while names and not names[-1]:
                    names.pop()
            elif inside == 'file' and not special and key:
                file.setdefault(key, entries[0] if entries else '')
            elif inside == 'segment' and not special and key:
                channels[key] = entries
    if inside == 'rows':
        segments.append(_HeadedRows(channels, names, first, rows))
    segments = [s for i, s in enumerate(segments) if s.rows or not i]
    if not segments or not segments[0].names:
        raise InputError(f'{path}: no names of channels below the headings of {_NAME}')
    if not segments[0].rows:
        raise InputError(f'{path}: no samples below the names of the channels')
    return _Heading(file, delimiter, segments)


def _of_channels(said: _HeadedRows, name: str, shown: list[int]) -> list[str]:
    """Return what a heading says of each channel, in the columns `shown`.

    An entry stands above its column, and none above the first. Where channels have columns of
    times, some writers leave no empty entries above these; any line of the heading with an entry
    above a column of times shows it.
    """
    above = {at - 1 for at in shown}
    beside = any(
        entry
        for line in _EACH
        for at, entry in enumerate(said.channels.get(line, []))
        if at not in above
    )
    entries = said.channels.get(name, [])
    places = range(len(shown)) if beside else sorted(above)
    return [entries[at] if 0 <= at < len(entries) else '' for at in places]


def _common(path: Path, said: _HeadedRows, name: str, shown: list[int]) -> str:
    """Return what a heading says of all channels alike.

    Raises:
        InputError: not the same of all.
    """
    found = set(_of_channels(said, name, shown)) - {''}
    if len(found) > 1:
        raise InputError(
            f'{path}: {name} differs between channels ({", ".join(sorted(found))}); save those of '
            'one clock as a file of their own'
        )
    return found.pop() if found else ''


def _number(path: Path, said: _HeadedRows, name: str, shown: list[int]) -> float:
    text = _common(path, said, name, shown)
    try:
        value = float(text.replace(',', '.'))
    except ValueError:
        value = np.nan
    if not np.isfinite(value) or (name == 'Delta_X' and value <= 0.0):
        raise InputError(f'{path}: {name} is {text!r}, but there is no column of times')
    return value


def _stamp_ns(path: Path, said: _Heading, segment: _HeadedRows, shown: list[int]) -> int:
    """Return the date and time of the measurement [ns], taken as UTC: no zone is written."""
    date = _common(path, segment, 'Date', shown) or said.file.get('Date', '')
    clock = _common(path, segment, 'Time', shown) or said.file.get('Time', '')
    text, _, fraction = f'{date} {clock}'.replace(',', '.').partition('.')
    try:
        whole = datetime.strptime(text, '%Y/%m/%d %H:%M:%S').replace(tzinfo=UTC).timestamp()
        return round(whole) * 10**9 + int(f'{fraction}000000000'[:9])
    except ValueError:
        return 0


FORMAT = Format(('.lvm',), _read, None, b'LabVIEW Measurement', _NAME, text=True)
