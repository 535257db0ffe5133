"""Channel maps: YAML that says where in a laboratory file command and measurement are."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from reprlib import repr as brief
from typing import Any, Literal

from actuator_glue.errors import InputError
from actuator_glue.given import of_kind
from actuator_glue.io.units import ROLES, common_motion, of_file
from actuator_glue.io.yaml_file import QUOTES, choice, mapping, number, read_file, texts, whole
from actuator_glue.records import check_stiffness

Column = str | int
# Columns that one file may have; a matrix with more is no list of channels.
MOST_COLUMNS = 10_000
_CHOICES = {
    'decimal': ('.', ','),
    'hold': ('zoh', 'linear'),
    'stamps': ('header', 'published', 'logged'),
}


@dataclass(frozen=True, slots=True)
class Channel:
    """One channel of a file.

    Attributes:
        column: name in full, or number counted from 1; of a bag `/topic`, `/topic.field`.
        unit: unit of the values after scaling.
        scale: factor from the file's values to `unit`, e.g. mm per V.
        offset: value in `unit` added after scaling.
        remove_rest_offset: subtract the mean of the first `rest_samples` samples.
    """

    column: Column
    unit: str
    scale: float = 1.0
    offset: float = 0.0
    remove_rest_offset: bool = False


@dataclass(frozen=True, slots=True)
class ChannelMap:
    """What a channel map says; everything but command and measured may be left out.

    Attributes:
        command: commanded displacement.
        measured: measured displacement.
        force: measured force.
        time: times of the samples; needed where there is no rate.
        rate: sample rate [Hz].
        sample_number: column that counts the samples, so that gaps are found.
        header_lines: lines before the first sample; the last of them names the columns.
        rows: samples that are read of a text; None for all, to its end.
        delimiter: text between columns; found by itself where left out.
        decimal: decimal sign, '.' or ','; found by itself where left out.
        rest_samples: samples at rest at the start, for `remove_rest_offset`.
        hold: how the command runs between its samples, zoh or linear; None for what the file says.
        stiffness: specimen stiffness [N/m]; None for what the file says.
        actuator: name of the actuator; None for what the file says.
        stamps: of a bag's messages: header (acquisition), published or logged; the first that
            every message has where left out.
        source: the map's file, for messages.
    """

    command: Channel
    measured: Channel
    force: Channel | None = None
    time: Channel | None = None
    rate: float | None = None
    sample_number: Column | None = None
    header_lines: int | None = None
    rows: int | None = None
    delimiter: str | None = None
    decimal: Literal['.', ','] | None = None
    rest_samples: int = 0
    hold: Literal['zoh', 'linear'] | None = None
    stiffness: float | None = None
    actuator: str | None = None
    stamps: Literal['header', 'published', 'logged'] | None = None
    source: str = ''

    def roles(self) -> dict[str, Channel]:
        """Return the channels that the map names, by role."""
        found = {role: getattr(self, role) for role in ROLES}
        return {role: channel for role, channel in found.items() if channel is not None}

    @property
    def motion(self) -> str:
        """What command and measured are in: metres, or another motion."""
        return common_motion({r: c.unit for r, c in self.roles().items()}, self.source)

    @property
    def topics(self) -> bool:
        """Whether the channels are topics of a bag."""
        columns = (channel.column for channel in self.roles().values())
        return all(isinstance(column, str) and column.startswith('/') for column in columns)


def read_channel_map(path: Path | str) -> ChannelMap:
    """Return the channel map of a YAML file, or one that comes with the package by its name.

    Raises:
        InputError: no such file, no YAML, unknown or missing entries, wrong kinds or units.
    """
    hint = '--channels takes the YAML file that describes the columns of a record, not the record'
    path, content = read_file(path, 'channel map', hint, 'channels')
    return parse_channel_map(content, str(path))


def channel_map_given(given: ChannelMap | PathLike[str] | str | None) -> ChannelMap | None:
    """Return a channel map that was given itself, or as a path or name; None for none.

    Raises:
        InputError: something else was given, or as `read_channel_map`.
    """
    if isinstance(given, (str, PathLike)):
        return read_channel_map(Path(given))
    kinds = (ChannelMap, type(None))
    of_kind(given, 'channels', kinds, 'the YAML file of a channel map, a shipped one, or None')
    return given


def parse_channel_map(content: object, source: str) -> ChannelMap:
    """Return the channel map that a mapping describes.

    Raises:
        InputError: unknown or missing entries, wrong kinds or units.
    """
    where = f'{source}: channel map'
    values = mapping(content, ChannelMap, where, hidden=('source',))
    for role in ROLES:
        if role in values:
            values[role] = _channel(values[role], role, f'{where}: {role}')
    number(values, 'rate', where, lower=0.1, upper=1e6)
    number(values, 'stiffness', where)
    if 'stiffness' in values:
        values['stiffness'] = check_stiffness(values['stiffness'], where)
    for name in ('header_lines', 'rows', 'rest_samples'):
        whole(values, name, where)
    for name, allowed in _CHOICES.items():
        choice(values, name, allowed, where)
    texts(values, ('delimiter', 'actuator'), where)
    if values.get('delimiter') == '':
        raise InputError(
            f'{where}: delimiter is empty; leave it out, and what parts the columns is found, or '
            'give the text between them'
        )
    check_column(values, 'sample_number', where)
    made = ChannelMap(**values, source=source)
    if made.topics and (made.time is not None or made.sample_number is not None):
        raise InputError(
            f'{where}: messages have stamps of their own; leave `time` and `sample_number` out'
        )
    if made.time is None and made.rate is None and not made.topics:
        raise InputError(f'{where}: give `rate` in Hz, or a `time` channel')
    common_motion({r: c.unit for r, c in made.roles().items()}, where)
    wants_rest = [c for c in (made.command, made.measured, made.force) if c is not None]
    if any(c.remove_rest_offset for c in wants_rest) and made.rest_samples < 1:
        raise InputError(f'{where}: remove_rest_offset needs rest_samples')
    return made


def _channel(content: object, role: str, where: str) -> Channel:
    values = mapping(content, Channel, where)
    check_column(values, 'column', where)
    check_unit(values, role, where)
    choice(values, 'remove_rest_offset', (True, False), where)
    return Channel(**values)


def check_unit(values: dict[str, Any], role: str, where: str) -> None:
    """Check unit, scale and offset of a channel.

    Raises:
        InputError: no unit of the role, no numbers, or a scale of 0.
    """
    unit = values.get('unit')
    if isinstance(unit, list):
        raise InputError(f'{where}: unit is {brief(unit)}; write it without brackets')
    of_file(role, str(unit) if unit else None, where)
    number(values, 'scale', where)
    number(values, 'offset', where)
    if values.get('scale') == 0.0:
        raise InputError(f'{where}: scale is 0; every value would be the same')


def check_column(values: dict[str, Any], name: str, where: str) -> None:
    """Hold an entry, where it is there, to the name of a column, or its number from 1.

    Raises:
        InputError: something else.
    """
    value = values.get(name, 1)
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        hint = f'; {QUOTES}' if isinstance(value, list) else ''
        raise InputError(f'{where}: {name} must be a name or a number, not {brief(value)}{hint}')
    if isinstance(value, int) and not 1 <= value <= MOST_COLUMNS:
        raise InputError(
            f'{where}: {name} is {value}; columns are counted from 1 to {MOST_COLUMNS}'
        )
