"""Layouts of streams as YAML files."""

from __future__ import annotations

from pathlib import Path

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import check_column, check_unit
from actuator_glue.io.units import ROLES
from actuator_glue.io.yaml_file import choice, mapping, number, read_file, texts, whole
from actuator_glue.records import check_motion, check_stiffness
from actuator_glue.streams.layout import TYPES, Field, Layout

NEEDED = ('command', 'measured')
MAX_FIELDS = 512
LARGEST_DATAGRAM = 65_507 - 32  # bytes; UDP over IPv4, room for a signature
_CHOICES = {
    'counts': ('packets', 'samples'),
    'byte_order': ('little', 'big'),
    'hold': ('zoh', 'linear'),
    'header': (False, True),
}


def read_layout(path: Path | str) -> Layout:
    """Return the layout of a YAML file, or one that comes with the package by its name.

    Raises:
        InputError: no such file, no YAML, unknown or missing entries, wrong kinds or units.
    """
    hint = 'layout takes the YAML file that describes a stream'
    path, content = read_file(path, 'layout', hint, 'layouts')
    return parse_layout(content, str(path))


def parse_layout(content: object, source: str) -> Layout:
    """Return the layout that a mapping describes.

    Raises:
        InputError: unknown or missing entries, wrong kinds or units.
    """
    where = f'{source}: layout'
    values = mapping(content, Layout, where, hidden=('source',))
    for part in ('packet', 'sample'):
        given = values.get(part, [])
        if not isinstance(given, list) or len(given) > MAX_FIELDS:
            raise InputError(f'{where}: {part} must be a list of at most {MAX_FIELDS} fields')
        values[part] = tuple(_field(f, f'{where}: {part}[{i}]') for i, f in enumerate(given))
    number(values, 'rate', where, lower=0.1, upper=1e5)
    whole(values, 'samples', where, 1, 10_000)
    for name, allowed in _CHOICES.items():
        choice(values, name, allowed, where)
    texts(values, ('delimiter', 'actuator', 'forward'), where)
    if values.get('delimiter') == '':
        raise InputError(f'{where}: delimiter is empty; leave it out for a comma')
    number(values, 'stiffness', where)
    if 'stiffness' in values:
        values['stiffness'] = check_stiffness(values['stiffness'], where)
    made = Layout(**values, source=source)
    _check(made, where)
    return made


def _field(content: object, where: str) -> Field:
    values = mapping(content, Field, where)
    texts(values, ('name',), where)
    choice(values, 'type', tuple(TYPES), where)
    number(values, 'scale', where)
    number(values, 'offset', where)
    whole(values, 'count', where, 1, 10_000)
    check_column(values, 'column', where)
    if values['name'] in ROLES:
        check_unit(values, values['name'], f'{where}: {values["name"]}')
    made = Field(**values)
    if made.name == 'counter' and (made.scale, made.offset) != (1.0, 0.0):
        raise InputError(f'{where}: a counter counts as it is sent; leave out scale and offset')
    if made.role and made.count != 1:
        raise InputError(f'{where}: {made.name} is one value; count is for those stepped over')
    return made


def _check(made: Layout, where: str) -> None:
    names = [f.name for f in (*made.packet, *made.sample) if f.role]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f'{where}: two fields are called {name}; keep one')
    for name in NEEDED:
        if name not in [f.name for f in made.sample]:
            raise InputError(f'{where}: sample has no field called {name}')
    channels: dict[str | int, list[str]] = {}
    place = 1
    for field in made.sample:
        if field.name in (*NEEDED, 'force'):
            channels.setdefault(field.column or place, []).append(field.name)
        place += field.count
    for column, same in channels.items():
        if len(same) > 1:
            raise InputError(f'{where}: {" and ".join(same)} are both column {column}')
    check_motion(made.motion, made.stiffness, where)
    if any(f.name in (*NEEDED, 'force') for f in made.packet):
        raise InputError(f'{where}: packet holds counter, time and what is stepped over only')
    size = sum(int(TYPES[f.type][1]) * f.count for f in made.packet)
    size += made.samples * sum(int(TYPES[f.type][1]) * f.count for f in made.sample)
    if size > LARGEST_DATAGRAM:
        raise InputError(f'{where}: packets of {size} bytes are larger than UDP carries')
