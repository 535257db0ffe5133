"""When the samples of LabVIEW's waveforms were taken, by the properties beside them.

TDMS has them, and so has HDF5 that was made of it. Channels that began at different times share
those samples that were taken together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.formats import Column
from actuator_glue.io.units import recognise
from actuator_glue.records import same_period

PROPERTIES = ('wf_start_time', 'wf_start_offset', 'wf_increment')
# Starts that differ by whole samples, up to this share of a sample, are of one clock.
_SAME = 0.02
# LabVIEW's time zero: the start of a waveform that was given none.
_UNKNOWN = np.datetime64('1904-01-01T00:00:00', 'us')
# LabVIEW's increment of a waveform that was given none [s]; no test is sampled so slowly.
_DEFAULT = 1.0


@dataclass(frozen=True, slots=True)
class WaveformClock:
    """When the samples of a waveform were taken.

    Attributes:
        name: of its channel.
        period: time between samples [s]; 0 for what is no waveform.
        offset: from the start to the first sample [s].
        start_ns: [ns since 1970]; None where nobody says.
        length: samples.
    """

    name: str
    period: float
    offset: float
    start_ns: int | None
    length: int


def of_properties(name: str, properties: Mapping[str, Any], length: int) -> WaveformClock:
    """Return the clock of a waveform.

    Args:
        name: of its channel.
        properties: of the channel, those of `PROPERTIES` among them; a period of 0 without an
            increment, or with LabVIEW's default.
        length: samples that it has.
    """
    period = float(properties.get('wf_increment', 0.0))
    return WaveformClock(
        name,
        period if period > 0.0 and period != _DEFAULT else 0.0,
        float(
            np.nan_to_num(float(properties.get('wf_start_offset', 0.0)), posinf=0.0, neginf=0.0)
        ),
        start_ns_of(properties),
        length,
    )


def start_ns_of(properties: Mapping[str, Any]) -> int | None:
    """Return the start of a waveform [ns]; None where none is said, or LabVIEW's time zero."""
    start: Any = properties.get('wf_start_time')
    if hasattr(start, 'as_datetime64'):
        start = start.as_datetime64('us')
    known = isinstance(start, np.datetime64) and start != _UNKNOWN and not np.isnat(start)
    return int(start.astype('datetime64[ns]').astype(np.int64)) if known else None


def _one_clock(one: WaveformClock, other: WaveformClock) -> bool:
    """Whether two waveforms have one period, and come to their end together as well."""
    apart = abs(one.period - other.period) * min(one.length, other.length)
    return same_period(one.period, other.period) and apart <= _SAME * one.period


def asked_for(columns: list[Column], channels: ChannelMap | None) -> list[int]:
    """Return the positions of the columns that a map names, or that are called by their role."""
    if channels is None:
        return [i for i, column in enumerate(columns) if recognise(column.label)]
    names = {channel.column for channel in channels.roles().values()}
    return [i for i, c in enumerate(columns) if {c.name, c.label, i + 1} & names]


def common_clock(
    clocks: list[WaveformClock], asked: list[int], path: Path
) -> tuple[dict[int, slice], float | None, int]:
    """Return which samples of each waveform were taken together, their period and start [ns].

    Raises:
        InputError: columns that are asked for have other rates, or starts between the samples of
            others, or were not taken at one time.
    """
    waveforms = [i for i, clock in enumerate(clocks) if clock.period]
    group = [i for i in asked if i in waveforms]
    if not group:
        # No waveforms are asked for: take those of the most common period.
        groups = [[j for j in waveforms if _one_clock(clocks[i], clocks[j])] for i in waveforms]
        group = max(groups, key=len, default=[])
    if not group:
        return {}, None, 0
    first = clocks[group[0]]
    starts = [clock.start_ns for clock in clocks if clock.start_ns is not None]
    zero = min(starts, default=0)

    def ahead(clock: WaveformClock) -> float:
        """Seconds from the file's first start to that of a waveform."""
        own = zero if clock.start_ns is None else clock.start_ns
        return (own - zero) * 1e-9 + clock.offset

    latest = max(ahead(clocks[i]) for i in group)
    cuts: dict[int, slice] = {}
    faults = []
    for i in group:
        clock = clocks[i]
        if not _one_clock(first, clock):
            faults.append(
                f'{first.name} has a sample every {first.period:.9g} s and {clock.name} one every '
                f'{clock.period:.9g} s'
            )
            continue
        late = (latest - ahead(clock)) / first.period
        begin = round(late)
        if abs(late - begin) > _SAME:
            faults.append(
                f'{clock.name} begins {latest - ahead(clock):.6g} s before another channel, which '
                'is no whole number of samples'
            )
        if begin >= clock.length - 1:
            faults.append(f'{clock.name} ends before another channel begins')
        cuts[i] = slice(begin, None)
    moved = any(cut.start for cut in cuts.values())
    others = [clocks[i].name for i in asked if i not in group]
    if moved and others:
        faults.append(
            f'{others[0]} has no start of its own, but those of the other channels differ'
        )
    if faults and asked:
        raise InputError(
            f'{path}: {faults[0]}; bring the channels to common times and save them again'
        )
    if faults:
        return {}, None, 0
    if moved:
        stop = min(clocks[i].length - cut.start for i, cut in cuts.items())
        cuts = {i: slice(cut.start, cut.start + stop) for i, cut in cuts.items()}
    return cuts, first.period, max(zero + round(latest * 1e9), 0)
