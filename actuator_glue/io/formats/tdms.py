"""Channels out of LabVIEW's TDMS files, read in chunks; needs npTDMS."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_attributes import scaling, unit_of
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.file_notes import of_groups
from actuator_glue.io.formats import (
    A_REMARK,
    Column,
    FileTable,
    Format,
    check_size,
    library,
    reading,
)
from actuator_glue.io.units import bare
from actuator_glue.io.waveforms import (
    PROPERTIES,
    WaveformClock,
    asked_for,
    common_clock,
    of_properties,
    start_ns_of,
)
from actuator_glue.records import Array, same_period

_NAME = 'a LabVIEW TDMS file'
# A waveform goes on where a later segment begins this near its next sample: the computer stamps a
# segment when it has it, by a clock of ticks of 15.6 ms, and late by what else it does: two ticks
# and some milliseconds [s], or a sample late one time and early another [1]. A shorter gap cannot
# be told from that for sure: it is told where all later segments are late too [samples].
_STAMPED, _STAMPED_SAMPLES = 0.04, 2.0
_LATE_SAMPLES = 1.5
# Computers and converters count seconds of their own, this far apart at most [1].
_DRIFT = 5e-4


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    tdms = library('nptdms', path).TdmsFile
    # What it warns of (a segment cut off by a killed writer) is nothing a user can act on; of text
    # that is none it prints all bytes. Its loggers have levels and a handler of their own.
    library('nptdms.log', path).log_manager.set_level(logging.CRITICAL)
    size = path.stat().st_size
    said = _said(path)
    columns: list[Column] = []
    clocks: list[WaveformClock] = []
    broken: list[str] = []
    doubts: list[str] = []
    unread: dict[str, str] = {}
    stamps: set[int] = set()
    with reading(path, _NAME), tdms.open(path) as file:
        notes, differ = of_groups(_texts(group.properties) for group in file.groups())
        notes |= _texts(file.properties)
        for group in file.groups():
            for channel in group.channels():
                if channel.data_type is None:
                    continue
                if np.dtype(channel.dtype).kind not in 'fiuM':
                    if len(channel) > A_REMARK:
                        unread[channel.name] = channel.data_type.__name__
                    continue
                # A value takes at least a byte of the file: a channel claiming more is damaged.
                if len(channel) > size:
                    raise InputError(
                        f'{path}: damaged: {channel.path} claims {len(channel)} values'
                    )
                name, label = f'{group.name}/{channel.name}', channel.name
                unit = unit_of(channel.properties)
                if np.dtype(channel.dtype).kind == 'M':
                    # Its type says its unit, whatever `time_ns` may say.
                    label, unit = bare(label), 's'
                    stamps.add(len(columns))
                columns.append(Column(name, label, unit, scaling(channel.properties)))
                last = of_properties(channel.name, channel.properties, len(channel))
                clock, fault, doubt = _whole(last, said.get(channel.path, []))
                clocks.append(clock)
                broken.append(fault)
                doubts.append(doubt)
    if not columns:
        raise InputError(f'{path}: no channel of numbers in this TDMS file')
    asked = asked_for(columns, channels)
    fault = next((broken[i] for i in asked if broken[i]), '')
    if fault:
        raise InputError(f'{path}: {fault}; save each part as a file of its own')
    cuts, period, start_ns = common_clock(clocks, asked, path)
    if any(i in stamps for i in asked):
        start_ns = 0  # times of such a column are absolute

    def values(wanted: list[int]) -> list[Array]:
        with reading(path, _NAME), tdms.open(path) as file:
            found = {f'{g.name}/{c.name}': c for g in file.groups() for c in g.channels()}
            read = [_values(found[columns[at].name], path) for at in wanted]
        return [column[cuts.get(at, slice(None))] for at, column in zip(wanted, read, strict=True)]

    told = (*differ, *[doubts[i] for i in asked if doubts[i]][:1])
    return FileTable(columns, notes, values, period, start_ns, unread=unread, told=told)


def _said(path: Path) -> dict[str, list[tuple[int, dict[str, Any]]]]:
    """Return what segments say of waveforms, by channel: behind how many values, and what.

    npTDMS keeps what the last segment says, and a start belongs to the first sample behind it.
    """
    reader: Any = library('nptdms.reader', path).TdmsReader
    found: dict[str, list[tuple[int, dict[str, Any]]]] = {}

    class SegmentHeadings(reader):
        """Reads the segments' headings, and keeps what each one says."""

        def _update_object_metadata(self, segment: Any) -> None:
            self.before = {name: o.num_values for name, o in self.object_metadata.items()}
            super()._update_object_metadata(segment)

        def _update_object_properties(self, properties: Any) -> None:
            for name, pairs in (properties or {}).items():
                own = {key: value for key, value in pairs if key in PROPERTIES}
                if own:
                    found.setdefault(name, []).append((self.before.get(name, 0), own))
            super()._update_object_properties(properties)

    with reading(path, _NAME), path.open('rb') as file:
        SegmentHeadings(file).read_metadata()
    return found


def _whole(
    last: WaveformClock, said: list[tuple[int, dict[str, Any]]]
) -> tuple[WaveformClock, str, str]:
    """Return the clock of a waveform from its first sample on, what breaks it, and what may.

    It is made of what each segment says, and of that of the last one.
    """
    first = previous = last
    at = 0  # values before what was said last
    late_at = [(0, 0.0)]
    now: dict[str, Any] = {}
    for before, said_here in said:
        own = dict(said_here)
        if 'wf_start_time' in now and start_ns_of(own) is None:
            own.pop('wf_start_time', None)
        known, now = now, {**now, **own}
        clock = of_properties(last.name, now, last.length)
        # What is said behind all samples, when a file is closed, is of all of them.
        if not known or not before or before >= last.length:
            first = previous = clock
            continue
        if now == known:
            continue  # every segment may repeat what the first one says
        if not same_period(previous.period, clock.period):
            fault = (
                f'{last.name} has a sample every {previous.period:.9g} s, and every '
                f'{clock.period:.9g} s from sample {before} on'
            )
            return first, fault, ''
        if previous.start_ns is None and clock.start_ns is not None:
            # The first samples came before the first start that anybody says.
            ahead = before * clock.period + first.offset - clock.offset
            first = replace(first, start_ns=clock.start_ns - round(ahead * 1e9))
            previous, at = clock, before
            continue
        allowed = max(_STAMPED, _STAMPED_SAMPLES * clock.period)
        passed = (before - at) * clock.period, before * clock.period
        faults = [
            late
            for since, time in zip((previous, first), passed, strict=True)
            if abs(late := _ahead(since, clock) - time) > allowed + _DRIFT * time
        ]
        if faults:
            late = max(faults, key=abs)
            how = 'after' if late > 0.0 else 'before'
            fault = (
                f'{last.name} begins anew at sample {before}, {abs(late):.6g} s {how} the samples '
                'before it end'
            )
            return first, fault, ''
        late_at.append((before, _ahead(first, clock) - before * clock.period))
        previous, at = clock, before
    return first, '', _late_for_good(last, late_at)


def _late_for_good(clock: WaveformClock, late_at: list[tuple[int, float]]) -> str:
    """Return in words where segments begin late, and all later ones too; nothing elsewhere.

    Stamps of a computer come late now and then; where samples are missing all later ones do, by
    more than those before the gap differ, and those behind it. Two segments alone do not tell.

    Args:
        clock: of the waveform.
        late_at: first sample of each segment, and how late it is [s].
    """
    at, late = np.array(late_at).T
    first, last = _range(late)[:, :-1], _range(late[::-1])[:, ::-1][:, 1:]
    steps = last[0] - first[1]
    beyond = steps - np.maximum(first[1] - first[0], last[1] - last[0])
    beyond -= (_DRIFT * np.diff(at) + _LATE_SAMPLES) * clock.period
    if len(steps) < 2 or beyond.max() < 0.0:
        return ''
    found = int(beyond.argmax())
    return (
        f'{clock.name}: the segments from sample {at[found + 1]:.0f} on begin some '
        f'{1e3 * steps[found]:.3g} ms late; taken as stamps that came late, but samples may be '
        'missing there'
    )


def _range(values: Array) -> Array:
    """Return the least and the greatest of some values up to each one, shape (2, n)."""
    return np.array([np.minimum.accumulate(values), np.maximum.accumulate(values)])


def _ahead(one: WaveformClock, other: WaveformClock) -> float:
    """Return how long after the first sample of a waveform that of another one was taken [s]."""
    passed = ((other.start_ns or 0) - (one.start_ns or 0)) * 1e-9
    return passed + other.offset - one.offset


def _texts(properties: Mapping[str, Any]) -> dict[str, str]:
    return {str(name): str(value) for name, value in properties.items()}


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
