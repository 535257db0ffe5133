"""Laboratory files to records: by the names of their columns, or through a channel map."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from actuator_glue.clock_check import APART, disagreement, rate_by_clock
from actuator_glue.errors import InputError
from actuator_glue.given import path as path_given
from actuator_glue.io.channel_map import Channel, ChannelMap, channel_map_given
from actuator_glue.io.file_notes import noted
from actuator_glue.io.formats import Column, FileTable, format_of
from actuator_glue.io.noted_rate import noted_rates
from actuator_glue.io.remarks import Note, warn_caller
from actuator_glue.io.resample import Resample, evenly, rate_and_way
from actuator_glue.io.signature import refuse_pipe
from actuator_glue.io.units import (
    FLOAT32_COUNTS,
    ROLES,
    choose,
    contradict,
    is_unit,
    of_file,
    recognise,
    symbol,
    written_unit,
)
from actuator_glue.records import Array, Hold, Record

# A channel "at rest" may move by this share of its range: noise does, a test does not.
_REST_SHARE = 0.1
# A rate that is wanted is another one than the file's if it differs by this share.
_OTHER_RATE = 1e-3
# The end of `pos_m` or `cmd_in` may be no unit: whoever makes a channel map knows.
_NO_UNIT = re.compile(r'_(?:\w|in)$')
# A column that may be of times, though it is not called so in full.
_CLOCK = re.compile(r'time|zeit|date|clock|stamp|^t\b', re.IGNORECASE)
_ZARR = ('zarr.json', '.zgroup', '.zarray')  # files of a Zarr store, which is a folder
_NEEDED = ('time', 'command', 'measured')


@dataclass(frozen=True, slots=True)
class Channels:
    """Channels of a file and what it says besides.

    Attributes:
        values: by role, times among them where a column holds them, each of shape (n,) [SI].
        period: time between samples [s] where no column of times says it.
        start_ns: time from which the times count [ns], 0 where nothing says it.
        stiffness: specimen stiffness [N/m]; None where nothing says it.
        hold: how the command runs between its samples; None where nothing says it.
        actuator: its name.
        motion: what command and measured are in: metres, or another motion.
        told: what a reader should know of what was taken, a line each.
    """

    values: dict[str, Array]
    period: float | None
    start_ns: int
    stiffness: float | None
    hold: str | None
    actuator: str
    motion: str
    told: tuple[str, ...]


def read(
    path: Path | str,
    *,
    channels: ChannelMap | Path | str | None = None,
    stiffness: float | None = None,
    hold: Hold | None = None,
    resample: Resample | None = None,
    warn: Note = warn_caller,
) -> Record:
    """Return the record of a laboratory file.

    Args:
        path: a file of any format in `formats`; delimited text where its suffix is no other's.
        channels: channel map; None where the names of the columns (of the variables) say what
            they are, as in `time_s,command_mm,measured_mm,force_N`.
        stiffness: specimen stiffness [N/m]; None for what map or file say.
        hold: how the command runs between its samples; None for what map or file say, else zoh.
        resample: samples per second [Hz] to which a jittered clock is made even; None where an
            uneven clock is refused. The record's source tells it, and its command runs straight
            between samples where nothing else is given. Band-limited; `(27.0, 'lines')` draws
            straight lines between samples.
        warn: called with a line that tells what resampling cost, that an even clock was left, or
            what was taken where the file leaves a choice.

    Raises:
        InputError: the file cannot be used; the message says what, where and what to do.
    """
    way = None if resample is None else rate_and_way(resample)
    found = channels_of(path, channels)
    for line in found.told:
        warn(f'{path}: {line}')
    values, period, source = found.values, found.period, str(path)
    said_hold = None if found.hold is None else found.hold.strip().lower()
    first = float(values['time'][0]) if 'time' in values else 0.0
    if period is None:
        values, period, made = evenly(values, way, source)
        if made is not None:
            warn(f'{path}: {made.told()}')
            source, said_hold = f'{path} ({made.name()})', said_hold or 'linear'
        elif way is not None and abs(period * way[0] - 1.0) > _OTHER_RATE:
            warn(
                f'{path}: its clock is even already, at {1.0 / period:.6g} Hz, and stays so: '
                '--resample makes jittered clocks even and changes no other rate; leave it out'
            )
    elif way is not None:
        raise InputError(f'{path}: no column of times is used, so there is nothing to resample')
    for column in values.values():
        column.flags.writeable = False  # nobody else has them: the record need not copy them
    if hold is None and said_hold not in (None, 'zoh', 'linear'):
        raise InputError(
            f'{path}: it says that its hold is {said_hold!r}; write zoh or linear there, or say '
            'which with --hold or in a channel map'
        )
    # Record refuses any other value.
    chosen = cast('Hold', hold or said_hold or 'zoh')
    return Record(
        command=values['command'],
        measured=values['measured'],
        force=values.get('force'),
        period=period,
        stiffness=found.stiffness if stiffness is None else stiffness,
        start_ns=max(found.start_ns + round(first * 1e9), 0),
        hold=chosen,
        actuator=found.actuator,
        source=source,
        motion=found.motion,
    )


def channels_of(
    path: Path | str,
    channels: ChannelMap | Path | str | None,
    *,
    needed: tuple[str, ...] = _NEEDED,
) -> Channels:
    """Return the channels of a laboratory file and what it says besides.

    Args:
        path: a file of any format.
        channels: channel map; None where the names of the columns say what they are.
        needed: roles that must be there; fewer for a file that is only a part of a test.

    Raises:
        InputError: the file cannot be used; the message says what, where and what to do.
    """
    path = path_given(path, 'file')
    if not path.exists():
        raise InputError(f'{path}: there is no such file')
    refuse_pipe(path)
    if path.is_dir() and any((path / name).exists() for name in _ZARR):
        raise InputError(f'{path}: this is a Zarr store, which is not read; save HDF5 or .csv')
    if path.is_dir():
        raise InputError(f'{path}: this is a folder, and no bag in MCAP format; give its files')
    channels = channel_map_given(channels)
    table = format_of(path).read(path, channels)
    told = [*table.told]
    if channels is None:
        roles, motion, period = _by_name(path, table, needed, told)
        values = in_si(_raw(path, roles, table), roles, str(path))
        if period is not None and 'time' in values:
            _check_period(period, values['time'], path)
            period = None
    else:
        roles = channels.roles() if needed == _NEEDED else _parts(channels, needed, table)
        motion = channels.motion
        period = None if channels.rate is None else 1.0 / channels.rate
        raw = _raw(path, roles, table, channels.sample_number)
        values = in_si(raw, roles, str(path), channels.rest_samples)
        told += _unlike_map(table, roles)
        if channels.rate is not None:
            _check_rate(channels.rate, values.get('time'), table, path)
    told += [*_unscaled(table, roles), *_unlike_clock(table, values.get('time'), period)]
    for name, column in values.items():
        if not len(column):
            raise InputError(
                f'{path}: channel {name!r} holds no sample; was the file closed by what wrote it, '
                'and copied whole?'
            )
    notes = noted(table.notes, str(path), beside_map=channels is not None)
    stiffness, hold = _noted_stiffness(notes, path), notes.get('hold')
    actuator = notes.get('actuator', 'actuator')
    if channels is not None:
        stiffness = stiffness if channels.stiffness is None else channels.stiffness
        hold, actuator = channels.hold or hold, channels.actuator or actuator
    return Channels(values, period, table.start_ns, stiffness, hold, actuator, motion, tuple(told))


def _noted_stiffness(notes: dict[str, str], path: Path) -> float | None:
    text = notes.get('stiffness_N_per_m')
    try:
        return None if text is None else float(text.removesuffix('N/m'))
    except ValueError as error:
        raise InputError(f'{path}: stiffness_N_per_m = {text!r} is not a number') from error


def _by_name(
    path: Path, table: FileTable, needed: tuple[str, ...], told: list[str]
) -> tuple[dict[str, Channel], str, float | None]:
    """Return the channels that names of columns say, their motion, and the period that is stated.

    What a reader should know of that is added to `told`.
    """
    period = table.period
    # Of a part of a test a rate does not say when it began.
    if period is None and needed == _NEEDED and (period := stated_period(table)) is not None:
        (note,) = noted_rates(table.notes).values()
        told.append(f'no column of times; {note!r} is taken, as it says')
    if period is not None:
        needed = tuple(role for role in needed if role != 'time')
    _refuse_unread(path, table, {*needed, 'force'})
    labels, units = [c.label for c in table.columns], [c.unit for c in table.columns]
    found, motion = choose(labels, units, str(path), needed)
    return {role: Channel(at + 1, unit) for role, (at, unit) in found.items()}, motion, period


def stated_period(table: FileTable) -> float | None:
    """Return the time between samples [s]: of waveforms, or by a note where no column tells it."""
    rates = [] if _may_hold_times(table) else [*noted_rates(table.notes)]
    return 1.0 / rates[0] if table.period is None and len(rates) == 1 else table.period


def _may_hold_times(table: FileTable) -> bool:
    """Whether a column may be of times, whatever it is called."""
    return any(
        _CLOCK.search(c.label) or (c.unit or written_unit(c.label)) in ROLES['time']
        for c in table.columns
    )


def _unlike_clock(table: FileTable, time: Array | None, period: float | None) -> Iterator[str]:
    """Yield where a note of a file states another sample rate than the clock that is taken."""
    by = 'channel map or waveform say' if time is None else 'its column of times says'
    for rate, note in noted_rates(table.notes).items():
        found = None
        if time is not None:
            found = rate_by_clock(np.arange(len(time)), time, rate)
        elif period is not None and abs(period * rate - 1.0) > APART:
            found = 1.0 / period
        if found is not None:
            yield (
                f'it says {note!r}, and is taken at {found:.6g} Hz, as {by}; mend the one that is '
                'wrong'
            )


def _refuse_unread(path: Path, table: FileTable, roles: set[str]) -> None:
    """Refuse a file whose only column for a role holds no numbers: it would be left out unseen."""
    found = {role for c in table.columns for role, _ in [recognise(c.label) or ('', '')]}
    for label, kind in table.unread.items():
        role, unit = recognise(label) or ('', '')
        # `force_mode` is no force, and what is true or false none that was kept as text.
        if role in roles - found and (not unit or is_unit(unit)) and 'bool' not in kind.lower():
            raise InputError(
                f'{path}: column {label!r} holds {kind} and no real numbers; save it as such, or '
                f'give it another name if it is not {role}'
            )


def _column(channel: Channel, table: FileTable, role: str) -> Column:
    return table.columns[position(channel.column, table.columns, role)]


def _unscaled(table: FileTable, roles: dict[str, Channel]) -> Iterator[str]:
    """Yield which gains and offsets stand beside numbers that are taken as they are."""
    as_they_are = {r: c for r, c in roles.items() if c.scale == 1.0 and c.offset == 0.0}
    columns = [_column(channel, table, role) for role, channel in as_they_are.items()]
    said = [f'{c.name.strip()} has {c.scaling}' for c in columns if c.scaling]
    if said:
        yield (
            f'{"; ".join(said)}: this is not applied, because nothing says whether the numbers '
            'have it already. If they have not, give it as `scale` or `offset` in a channel map'
        )


def _unlike_map(table: FileTable, roles: dict[str, Channel]) -> Iterator[str]:
    """Yield where a map gives another unit than the file does, and no scale between them."""
    for role, channel in roles.items():
        column = _column(channel, table, role)
        said = symbol(column.unit)
        if not said and (recognise(column.label) or not _NO_UNIT.search(column.label)):
            said = written_unit(column.label)
        if channel.scale == 1.0 and contradict(channel.unit, said):
            own = f'`unit: {said}`, or ' if said in ROLES[role] else ''
            yield (
                f'{role}: the channel map says {channel.unit!r}, and the file {said!r} of column '
                f'{column.name.strip()!r}; the map counts. If the file is right, give {own}'
                f'{channel.unit} per {said} as `scale`'
            )


def _parts(channels: ChannelMap, needed: tuple[str, ...], table: FileTable) -> dict[str, Channel]:
    """Return the channels of a map that a file has which is only a part of a test.

    A column's number does not say which file it is meant for: it counts for the roles needed
    there, and a force's for the file of the measured displacement.
    """
    names = {name for column in table.columns for name in (column.name, column.label)}
    own = {*needed, 'force'} if 'measured' in needed else set(needed)
    return {
        role: channel
        for role, channel in channels.roles().items()
        if channel.column in names
        or (isinstance(channel.column, int) and role in own)
        or role in needed
    }


def _check_rate(rate: float, time: Array | None, table: FileTable, path: Path) -> None:
    """Refuse a rate in a channel map [Hz] that the file's own clock contradicts.

    Where the map names no times, a column that is called time with a unit is looked at.
    """
    clocks = {}
    for at, column in enumerate(table.columns if time is None else ()):
        role, unit = recognise(column.label) or ('', '')
        if role == 'time' and (unit or column.unit) in ROLES['time']:
            time = table.values([at])[0] * ROLES['time'][unit or column.unit]
            break
    if time is not None:
        found = rate_by_clock(np.arange(len(time)), time, rate)
        clocks = {} if found is None else {'its column of times': found}
    elif table.period is not None and abs(table.period * rate - 1.0) > APART:
        clocks = {'what the file states': 1.0 / table.period}
    if clocks:
        raise InputError(
            f'{path}: {disagreement(rate, clocks)}; take `rate` out of the channel map, or mend it'
        )


def _check_period(period: float, time: Array, path: Path) -> None:
    """Refuse a file whose column of times contradicts the period that it states besides [s]."""
    # In units of periods: the comparison wants two seconds of any rate.
    found = rate_by_clock(np.arange(len(time)), time / period, 1.0)
    if found is not None:
        clocks = {'its column of times': found / period}
        raise InputError(
            f'{path}: {disagreement(1.0 / period, clocks)}; mend the one '
            'that is wrong, or name the column in a channel map as `time`'
        )


def in_si(
    raw: dict[str, Array], roles: dict[str, Channel], source: str, rest_samples: int = 0
) -> dict[str, Array]:
    """Return channels in SI units, scaled, offsets at rest removed, by their role.

    Args:
        raw: by role, as a file has them, each of shape (n,).
        roles: what they are.
        source: file, for messages.
        rest_samples: samples at rest at the start, where an offset is to be removed.

    Raises:
        InputError: a channel is not at rest where its map says so.
    """
    values = {}
    with np.errstate(all='ignore'):  # values that are not finite are reported later
        for role, channel in roles.items():
            where, column = f'{source}: {role}', raw[role]
            if (channel.scale, channel.offset) != (1.0, 0.0):
                column = column * channel.scale + channel.offset
            if channel.remove_rest_offset:
                column = column - _rest_offset(column, rest_samples, where, role)
            factor = of_file(role, channel.unit, where)
            values[role] = column if factor == 1.0 else column * factor
    return values


def _raw(
    path: Path, roles: dict[str, Channel], table: FileTable, sample_number: str | int | None = None
) -> dict[str, Array]:
    """Return channels as the file has them; what counts the samples is checked."""
    wanted: dict[str, str | int] = {role: channel.column for role, channel in roles.items()}
    if sample_number is not None:
        wanted['sample_number'] = sample_number
    at = {role: position(c, table.columns, f'{path}: {role}') for role, c in wanted.items()}
    raw = dict(zip(at, table.values([*at.values()]), strict=True))
    _check_numbers(raw, at, table, path)
    if sample_number is not None:
        _check_counter(raw['sample_number'], path)
    return raw


def _check_numbers(
    raw: dict[str, Array], positions: dict[str, int], table: FileTable, path: Path
) -> None:
    """Refuse what is no number where the file can show the place."""
    if table.entry is None:
        return
    for role, at in positions.items():
        bad = ~np.isfinite(raw[role])
        if bad.any():
            row = int(bad.argmax())
            if role == 'time' and bad.all():
                raise InputError(
                    f'{path}: time is not understood in any sample, first in '
                    f'{table.entry(row, at)}; write seconds, or times as in '
                    '2024-05-03 08:00:00.123, and name the column for instance time_s'
                )
            raise InputError(
                f'{path}: {role} is NaN or infinite, or no number, in {int(bad.sum())} of '
                f'{len(bad)} samples, first in {table.entry(row, at)}; cut or repair the record '
                'there'
            )


def position(column: str | int, columns: list[Column], where: str) -> int:
    """Return the position from 0 of a column given by name or by number from 1.

    Raises:
        InputError: there are not as many, or no column, or more than one, has that name.
    """
    if isinstance(column, int):
        if column > len(columns):
            raise InputError(
                f'{where}: cannot read the samples: there are {len(columns)} columns, and number '
                f'{column} is asked for'
            )
        return column - 1
    hits = [i for i, c in enumerate(columns) if c.name == column]
    hits = hits or [i for i, c in enumerate(columns) if c.label == column]
    if len(hits) != 1:
        problem = 'no column is' if not hits else f'{len(hits)} columns are'
        listed = ', '.join(repr(c.name) for c in columns[:20]) or 'without names'
        raise InputError(f'{where}: {problem} called {column!r}; the columns are {listed}')
    return hits[0]


def _check_counter(counter: Array, path: Path) -> None:
    steps = np.diff(counter)
    odd = steps != 1.0
    if odd.any():
        at = int(odd.argmax())
        if counter[at] >= FLOAT32_COUNTS and np.array_equal(counter, counter.astype(np.float32)):
            raise InputError(
                f'{path}: sample numbers beyond {FLOAT32_COUNTS} are stored as float32, which '
                'cannot count them one by one; leave `sample_number` out of the channel map, or '
                'save them as float64'
            )
        raise InputError(
            f'{path}: sample numbers jump from {counter[at]:.0f} to {counter[at + 1]:.0f}; '
            'samples are missing: cut the record there'
        )


def _rest_offset(column: Array, samples: int, where: str, role: str) -> float:
    if samples >= len(column):
        raise InputError(f'{where}: {samples} rest samples, but {len(column)} in the file')
    rest = column[:samples]
    span, whole = float(np.ptp(rest)), float(np.ptp(column))
    if span > _REST_SHARE * whole:
        if role == 'force':
            # No zero of the force is used anywhere: its channel keeps its offset.
            return 0.0
        raise InputError(
            f'{where}: not at rest in the first {samples} samples (moves {span:.3g} of '
            f'{whole:.3g} in all); lower rest_samples, or do not remove a rest offset'
        )
    return float(rest.mean())
