"""Laboratory files to records: CSV, MATLAB .mat, and any text through a channel map."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import Channel, ChannelMap, read_channel_map
from actuator_glue.io.delimited import position, read_columns, read_head
from actuator_glue.io.matlab import read_variables
from actuator_glue.io.time_base import uniform_period
from actuator_glue.io.units import choose, factor, recognise
from actuator_glue.records import Array, Hold, Record

# A channel "at rest" may move by this share of its range: noise does, a test does not.
_REST_SHARE = 0.1


def read(
    path: Path | str,
    *,
    channels: ChannelMap | Path | str | None = None,
    stiffness: float | None = None,
    hold: Hold | None = None,
    actuator: str | None = None,
) -> Record:
    """Return the record of a laboratory file.

    Args:
        path: .mat, or delimited text of any other suffix.
        channels: channel map; None where the names of the columns (of the variables) say what
            they are, as in `time_s,command_mm,measured_mm,force_N`.
        stiffness: specimen stiffness [N/m]; None for what map or file say.
        hold: how the command runs between its samples; None for what map or file say, else zoh.
        actuator: name of the actuator; None for what map or file say.

    Raises:
        InputError: the file cannot be used; the message says what, where and what to do.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f'{path}: there is no such file')
    if path.is_dir():
        raise InputError(f'{path}: this is a folder, and no bag in MCAP format')
    if isinstance(channels, (str, Path)):
        channels = read_channel_map(channels)
    notes: dict[str, str] = {}
    if channels is not None:
        values, period = _mapped(path, channels)
        notes = {'hold': channels.hold or 'zoh', 'actuator': channels.actuator}
        stiffness = channels.stiffness if stiffness is None else stiffness
    else:
        values, notes = _mat_by_name(path) if path.suffix == '.mat' else _text_by_name(path)
        period = uniform_period(values['time'], str(path))
        if stiffness is None:
            stiffness = _noted_stiffness(notes, path)
    first = float(values['time'][0]) if 'time' in values else 0.0
    # Record refuses another.
    chosen = cast('Hold', hold or notes.get('hold', 'zoh'))
    return Record(
        command=values['command'],
        measured=values['measured'],
        force=values.get('force'),
        period=period,
        stiffness=stiffness,
        start_ns=max(round(first * 1e9), 0),
        hold=chosen,
        actuator=actuator or notes.get('actuator', 'actuator'),
        source=str(path),
    )


def _noted_stiffness(notes: dict[str, str], path: Path) -> float | None:
    text = notes.get('stiffness_N_per_m')
    try:
        return None if text is None else float(text)
    except ValueError as error:
        raise InputError(f'{path}: stiffness_N_per_m = {text!r} is not a number') from error


def _text_by_name(path: Path) -> tuple[dict[str, Array], dict[str, str]]:
    head = read_head(path)
    if not any(recognise(name) for name in head.names) and _numeric(head.names):
        raise InputError(
            f'{path}: the first line must name the columns with their units, as in '
            'time_s,command_mm,measured_mm,force_N; or describe the file with --channels MAP.yaml'
        )
    columns = choose(head.names, str(path))
    data = read_columns(path, head, [at for at, _ in columns.values()])
    values = {role: data[:, i] * scale for i, (role, (_, scale)) in enumerate(columns.items())}
    return values, head.notes


def _numeric(names: list[str]) -> bool:
    try:
        [float(name) for name in names]
    except ValueError:
        return False
    return True


def _mat_by_name(path: Path) -> tuple[dict[str, Array], dict[str, str]]:
    vectors, texts = read_variables(path)
    names = list(vectors)
    # `test.command_mm` is command_mm of the struct `test`.
    columns = choose([name.rpartition('.')[2] for name in names], str(path))
    values = {role: vectors[names[at]] * scale for role, (at, scale) in columns.items()}
    notes = {name.rpartition('.')[2]: text for name, text in texts.items()}
    for name, vector in vectors.items():
        if name.rpartition('.')[2] == 'stiffness_N_per_m' and len(vector) == 1:
            notes['stiffness_N_per_m'] = repr(float(vector[0]))
    return values, notes


def _mapped(path: Path, channels: ChannelMap) -> tuple[dict[str, Array], float]:
    """Return channels in SI units, rest offsets removed, and the period."""
    roles = {
        role: channel
        for role in ('time', 'command', 'measured', 'force')
        if (channel := getattr(channels, role)) is not None
    }
    raw, counter = (_raw_mat if path.suffix == '.mat' else _raw_text)(path, channels, roles)
    if counter is not None:
        _check_counter(counter, path)
    values = {}
    for role, channel in roles.items():
        where = f'{path}: {role}'
        column = raw[role] * channel.scale + channel.offset
        if channel.remove_rest_offset:
            column = column - _rest_offset(column, channels.rest_samples, where, role)
        values[role] = column * factor(role, channel.unit, where)
    if channels.rate is not None:
        return values, 1.0 / channels.rate
    return values, uniform_period(values['time'], str(path))


def _raw_text(
    path: Path, channels: ChannelMap, roles: dict[str, Channel]
) -> tuple[dict[str, Array], Array | None]:
    head = read_head(path, channels.header_lines, channels.delimiter)
    wanted = [position(c.column, head.names, f'{path}: {role}') for role, c in roles.items()]
    if channels.sample_number is not None:
        wanted.append(position(channels.sample_number, head.names, f'{path}: sample_number'))
    data = read_columns(path, head, wanted, channels.decimal)
    counter = data[:, -1] if channels.sample_number is not None else None
    return {role: data[:, i] for i, role in enumerate(roles)}, counter


def _raw_mat(
    path: Path, channels: ChannelMap, roles: dict[str, Channel]
) -> tuple[dict[str, Array], Array | None]:
    vectors, _ = read_variables(path)

    def vector(column: str | int, role: str) -> Array:
        name = list(vectors)[position(column, list(vectors), f'{path}: {role}')]
        return vectors[name]

    counter = None
    if channels.sample_number is not None:
        counter = vector(channels.sample_number, 'sample_number')
    return {role: vector(c.column, role) for role, c in roles.items()}, counter


def _check_counter(counter: Array, path: Path) -> None:
    steps = np.diff(counter)
    odd = steps != 1.0
    if odd.any():
        at = int(odd.argmax())
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
