"""Layouts of streams as YAML files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from reprlib import repr as brief

from actuator_glue.errors import InputError
from actuator_glue.io.units import ROLES, of_file
from actuator_glue.io.yaml_file import located, mapping, number, parse, read_text, whole
from actuator_glue.records import check_motion, check_stiffness
from actuator_glue.streams.layout import TYPES, Field, Layout

NEEDED = ('command', 'measured')
MAX_FIELDS = 512
LARGEST_DATAGRAM = 65_507 - 32  # bytes; UDP over IPv4, room for a signature


def read_layout(path: Path | str) -> Layout:
    """Return the layout of a YAML file, or one that comes with the package by its name.

    Raises:
        InputError: no such file, no YAML, unknown or missing entries, wrong kinds or units.
    """
    path = located(path, 'layouts')
    hint = 'layout takes the YAML file that describes a stream'
    text = read_text(path, 'layout', hint, 'layouts')
    return parse_layout(parse(text, f'{path}: layout'), str(path))


def parse_layout(content: object, source: str) -> Layout:
    """Return the layout that a mapping describes.

    Raises:
        InputError: unknown or missing entries, wrong kinds or units.
    """
    where = f'{source}: layout'
    values = mapping(content, Layout, where, hidden=('source',))
    for part in ('packet', 'sample'):
        given = values.get(part) or []
        if not isinstance(given, list) or len(given) > MAX_FIELDS:
            raise InputError(f'{where}: {part} must be a list of at most {MAX_FIELDS} fields')
        values[part] = tuple(_field(f, f'{where}: {part}[{i}]') for i, f in enumerate(given))
    number(values, 'rate', where, lower=0.1, upper=1e5)
    whole(values, 'samples', where, 1, 10_000)
    for name, allowed in (
        ('counts', ('packets', 'samples')),
        ('byte_order', ('little', 'big')),
        ('hold', ('zoh', 'linear')),
        ('header', (False, True)),
    ):
        if values.get(name) is not None and values[name] not in allowed:
            raise InputError(
                f'{where}: {name} is {brief(values[name])}; use one of '
                f'{", ".join(map(str, allowed))}'
            )
    for name in ('delimiter', 'actuator', 'forward'):
        if values.get(name) is not None and not isinstance(values[name], str):
            raise InputError(f'{where}: {name} must be text, not {brief(values[name])}')
    if values.get('delimiter') == '':
        raise InputError(f'{where}: delimiter is empty; leave it out for a comma')
    number(values, 'stiffness', where)
    if values.get('stiffness') is not None:
        values['stiffness'] = check_stiffness(values['stiffness'], where)
    made = Layout(**{k: v for k, v in values.items() if v is not None})
    made = replace(made, source=source)
    _check(made, where)
    return made


def _field(content: object, where: str) -> Field:
    values = mapping(content, Field, where)
    if not isinstance(values['name'], str):
        raise InputError(f'{where}: name must be text, not {brief(values["name"])}')
    if values.get('type') is not None and values['type'] not in list(TYPES):
        raise InputError(
            f'{where}: type is {brief(values["type"])}; use one of {", ".join(TYPES)}'
        )
    number(values, 'scale', where)
    number(values, 'offset', where)
    whole(values, 'count', where, 1, 10_000)
    column = values.get('column')
    if column is not None and (
        isinstance(column, bool)
        or not isinstance(column, (str, int))
        or (isinstance(column, int) and not 1 <= column <= 10_000)
    ):
        raise InputError(f'{where}: column must be a name or a number from 1, not {brief(column)}')
    made = Field(**{k: v for k, v in values.items() if v is not None})
    if made.name in ROLES:
        unit = values.get('unit')
        of_file(made.name, str(unit) if unit else None, f'{where}: {made.name}')
        if made.scale == 0.0:
            raise InputError(f'{where}: scale is 0; every value would be the same')
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
