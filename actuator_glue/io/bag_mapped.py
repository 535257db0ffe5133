"""Records out of any topics of a bag, through a channel map.

The command defines the samples: where its messages lie on a uniform clock, each is a sample;
elsewhere the command is read at uniform times as its hold says. Measurements of other times are
interpolated to the samples. A message that is missing is a gap.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.even_times import near_whole_rate
from actuator_glue.io.bag_reader import summarise
from actuator_glue.io.bag_topics import Stamps, TopicSeries, topic_series
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.laboratory import in_si
from actuator_glue.io.remarks import Note, refuse, tell_gap, warn_caller
from actuator_glue.io.resample import at_times
from actuator_glue.records import Array, Hold, Record

# A step of this many periods is a gap, whatever the clock does after it.
_GAP = 2.5
# A step of this many is a gap if the clock lags by half a period afterwards: a message is missing.
_STEP, _LAG, _NEAR = 1.5, 0.5, 10


def read_mapped(
    path: Path | str,
    channels: ChannelMap,
    *,
    note: Note = refuse,
    gap: Note | None = None,
    warn: Note = warn_caller,
) -> list[Record]:
    """Return the records of a bag whose topics a channel map names.

    Args:
        path: bag folder or lone .mcap.
        channels: the map; its columns are `/topic` or `/topic.field`.
        note: called with one line per damage; the default raises it.
        gap: called with one line where messages are missing, and the test is split there; the
            default raises.
        warn: called with one line where channels had to be brought to common times.

    Raises:
        InputError: no bag, damage, a topic that is not there or cannot be decoded, topics that
            do not overlap in time, or gaps without `gap`.
    """
    wanted = {role: str(channel.column) for role, channel in channels.roles().items()}
    series = topic_series(path, set(wanted.values()), note)
    found = {role: _of(name, series, path) for role, name in wanted.items()}
    kind = _stamps(channels, [topic for topic, _ in found.values()], path)
    zero = min(min(topic.times[kind]) for topic, _ in found.values())
    tracks: dict[str, tuple[Array, Array]] = {}
    for role, (topic, values) in found.items():
        times = topic.seconds(kind, zero)
        order = np.argsort(times, kind='stable')
        tracks[role] = times[order], values[order]
        if len(times) < 3 or not np.diff(times[order]).min() > 0.0:
            raise InputError(
                f'{path}: topic {topic.topic}: fewer than three messages, or two of one time; '
                'choose other `stamps` in the channel map'
            )
    stretches = _stretches(tracks, f'{path}', gap)
    hold: Hold = channels.hold or 'zoh'
    records: list[Record] = []
    for begin, end in stretches:
        raw, start, period = _sampled(tracks, (begin, end), channels.rate, hold, warn, f'{path}')
        if len(raw['command']) < 2:
            continue
        channel = in_si(raw, channels.roles(), str(path), channels.rest_samples)
        number = f' (record {len(records) + 1})' if len(stretches) > 1 else ''
        records.append(
            Record(
                command=channel['command'],
                measured=channel['measured'],
                force=channel.get('force'),
                period=period,
                stiffness=channels.stiffness,
                start_ns=zero + round(start * 1e9),
                hold=hold,
                actuator=channels.actuator or 'actuator',
                source=f'{path}{number}',
                motion=channels.motion,
            )
        )
    if not records:
        spans = ', '.join(f'{n} {t[0]:.3f} to {t[-1]:.3f} s' for n, (t, _) in tracks.items())
        raise InputError(f'{path}: the topics do not overlap in time ({spans}, {kind} stamps)')
    return records


def _of(name: str, series: dict[str, TopicSeries], path: Path | str) -> tuple[TopicSeries, Array]:
    for topic in series.values():
        values = topic.column(name)
        if values is not None:
            return topic, values
    held = [n for topic in series.values() for n in topic.names()]
    held = held or [f'{t.name} ({t.type})' for t in summarise(path).topics.values()]
    raise InputError(
        f'{path}: {name} is no number of a topic of this bag; it holds {", ".join(held[:12])}; '
        f'`actuator-glue map {path}` lists them'
    )


def _stamps(channels: ChannelMap, topics: list[TopicSeries], path: Path | str) -> Stamps:
    """Return the kind of stamp that every message of the topics has, acquisition first."""
    kinds: tuple[Stamps, ...] = ('header', 'published', 'logged')
    for kind in (channels.stamps,) if channels.stamps else kinds:
        if all(min(topic.times[kind]) > 0 for topic in topics):
            return kind
    asked = channels.stamps or 'usable'
    raise InputError(f'{path}: not every message of these topics has {asked} stamps')


def _stretches(
    tracks: dict[str, tuple[Array, Array]], where: str, gap: Note | None
) -> list[tuple[float, float]]:
    """Return begin and end of the stretches in which no message is missing."""
    cuts: list[tuple[float, float]] = []
    for role, (times, _) in tracks.items():
        for at in _gaps(times):
            fault = f'{where}: {role}: nothing for {times[at + 1] - times[at]:.4g} s after '
            tell_gap(f'{fault}{times[at]:.6g} s', gap)
            cuts.append((float(times[at]), float(times[at + 1])))
    begin = max(float(times[0]) for times, _ in tracks.values())
    stop = min(float(times[-1]) for times, _ in tracks.values())
    stretches = []
    for cut, after in sorted(cuts):
        if cut > begin:
            stretches.append((begin, min(cut, stop)))
        begin = max(begin, after)
    return [(b, e) for b, e in [*stretches, (begin, stop)] if e > b]


def _gaps(times: Array) -> list[int]:
    """Return the samples after which messages are missing, not only late."""
    steps = np.diff(times)
    period = float(np.median(steps))
    late = times - period * np.arange(len(times))
    gaps = []
    for at in np.flatnonzero(steps > _STEP * period).tolist():
        before, after = late[max(at + 1 - _NEAR, 0) : at + 1], late[at + 1 : at + 1 + _NEAR]
        lag = float(np.median(after) - np.median(before))
        if steps[at] > _GAP * period or lag > _LAG * period:
            gaps.append(at)
    return gaps


def _sampled(
    tracks: dict[str, tuple[Array, Array]],
    stretch: tuple[float, float],
    rate: float | None,
    hold: Hold,
    warn: Note,
    where: str,
) -> tuple[dict[str, Array], float, float]:
    """Return channels at common uniform times within a stretch, the first time, the period."""
    cut = {role: _within(track, stretch) for role, track in tracks.items()}
    times, measured = cut['command'][0], cut['measured'][0]
    if len(times) < 2 or len(measured) < 2:
        return {'command': times[:0]}, 0.0, 1.0
    own, other = (_period(stamps) for stamps in (times, measured))
    # A command that comes less often than measurements is held between its messages.
    period = 1.0 / rate if rate is not None else own if own < 1.5 * other else other
    index = np.arange(len(times))
    first = float(np.mean(times - period * index))
    late = np.abs(times - first - period * index)
    one_by_one = float(late.max()) < 0.5 * period
    if not one_by_one:
        first = stretch[0]
        index = np.arange(int((stretch[1] - first) / period) + 1)
    grid = np.asarray(first + period * index, dtype=np.float64)
    raw: dict[str, Array] = {}
    slack = 1e-6 * period
    whole = np.ones(len(grid), dtype=bool)
    for role, (stamps, values) in cut.items():
        if one_by_one and (role == 'command' or np.array_equal(stamps, times)):
            raw[role] = values
            continue
        held = role == 'command' and hold == 'zoh'
        raw[role] = at_times(stamps, values, grid, held=held)
        if not held:
            whole &= (grid >= stamps[0] - slack) & (grid <= stamps[-1] + slack)
            warn(f'{where}: {role} is interpolated to the times of the samples')
    if not one_by_one:
        warn(
            f'{where}: messages of the command lie up to {1e3 * late.max():.3g} ms off a clock of '
            f'{1.0 / period:.6g} Hz; it is read there as its hold says'
        )
    (inside,) = np.nonzero(whole)
    start = float(grid[inside[0]]) if len(inside) else first
    return {role: values[whole] for role, values in raw.items()}, start, period


def _period(times: Array) -> float:
    """Return the period of the uniform clock next to some times."""
    slope = float(np.polyfit(np.arange(len(times)), times - times[0], 1)[0])
    return near_whole_rate(slope, len(times))


def _within(track: tuple[Array, Array], stretch: tuple[float, float]) -> tuple[Array, Array]:
    times, values = track
    inside = (times >= stretch[0]) & (times <= stretch[1])
    return times[inside], values[inside]
