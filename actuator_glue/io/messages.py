"""Wire types without ROS: message definitions, their hashes, and CDR to and from bytes.

The text of `msg_defs/msg/*.msg` is the only source; standard ROS types come from rosbags.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore

from actuator_glue.errors import InputError

PACKAGE = 'actuator_glue_msgs'
_RULE = '=' * 80
# rmw implementations align an empty array's missing elements when they reckon a message's size,
# and send the bytes that are then left over; rosbags itself refuses such messages.
MAX_SPARE = 64
_NOTHING: dict[str, Any] = {'string': '', 'bool': False}
_UNDECODABLE = (
    SerdeError,
    struct.error,
    KeyError,
    AssertionError,
    IndexError,
    OverflowError,
    ValueError,
    MemoryError,
)


@dataclass(frozen=True, slots=True)
class MessageType:
    """What a bag must hold of a type.

    Attributes:
        name: full name, `package/msg/Name`.
        definition: ros2msg text, the type's own and those it uses, as rosbag2 embeds it.
        rihs01: type hash, as rosbag2 prints it.
    """

    name: str
    definition: str
    rihs01: str


def _definition_folders() -> Iterator[Path]:
    """Places where the .msg files lie: this package, the checkout, sourced workspaces."""
    package = Path(__file__).resolve().parent.parent
    yield package / 'interfaces' / 'msg'
    yield package.parent / 'msg_defs' / 'msg'
    yield from _workspace_folders(PACKAGE)


def _workspace_folders(package: str) -> Iterator[Path]:
    for prefix in filter(None, os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep)):
        yield Path(prefix) / 'share' / package / 'msg'


@cache
def definition_folder() -> Path:
    """Return the folder that holds SampleBlock.msg.

    Raises:
        InputError: this installation has none.
    """
    for folder in _definition_folders():
        if (folder / 'SampleBlock.msg').is_file():
            return folder
    raise InputError(
        f'the message definitions of {PACKAGE} are not installed; run `make setup`, or source '
        'the workspace that holds them'
    )


@cache
def typestore() -> Any:
    """Return rosbags' type store with ROS 2 Jazzy's types and ours."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types = {}
    for path in sorted(definition_folder().glob('*.msg')):
        types.update(get_types_from_msg(path.read_text('utf-8'), full_name(path.stem)))
    store.register(types)
    return store


def full_name(name: str) -> str:
    """Return `actuator_glue_msgs/msg/Name` for `Name`; a full name is returned as it is."""
    return name if '/' in name else f'{PACKAGE}/msg/{name}'


def _text(name: str) -> str | None:
    """Return the .msg file of a type: ours, or one of a sourced workspace."""
    package, _, stem = name.replace('/msg/', '/').partition('/')
    folders = [definition_folder()] if package == PACKAGE else _workspace_folders(package)
    for folder in folders:
        if (folder / f'{stem}.msg').is_file():
            return (folder / f'{stem}.msg').read_text('utf-8')
    return None


def _learn(name: str) -> None:
    """Take a type that rosbags does not know, and those it uses, from a sourced workspace."""
    store = typestore()
    text = None if name in store.fielddefs else _text(name)
    if text is None:
        return
    types = get_types_from_msg(text, name)
    for _, kind in types[name][1]:
        # A field is (code, what), an array of such (code, ((code, what), length)).
        used = kind[1] if isinstance(kind[1], str) else kind[1][0][1]
        if isinstance(used, str) and '/' in used:
            _learn(used)
    store.register(types)


@cache
def message_type(name: str) -> MessageType:
    """Return definition and hash of a type; ours keep their comments, which carry the units.

    Types of other packages are found where their workspace is sourced.

    Raises:
        InputError: the type is unknown, or its .msg file cannot be parsed.
    """
    name = full_name(name)
    store = typestore()
    try:
        _learn(name)
        text, _ = store.generate_msgdef(name, ros_version=2)
        rihs01 = store.hash_rihs01(name)
    except TypesysError as error:
        raise InputError(f'message type {name} is unknown ({error})') from error
    own, *used = text.split(f'{_RULE}\nMSG: ')
    parts = [_text(name) or own]
    for part in used:
        title, body = part.split('\n', 1)
        parts.append(f'MSG: {title}\n{_text(title) or body}')
    definition = f'{_RULE}\n'.join(p if p.endswith('\n') else p + '\n' for p in parts)
    return MessageType(name, definition, rihs01)


def message(name: str, **fields: Any) -> Any:
    """Return a message object of a type, for `serialize`."""
    return typestore().types[full_name(name)](**fields)


def header(stamp_ns: int, frame_id: str) -> Any:
    """Return a std_msgs/Header."""
    sec, nanosec = divmod(int(stamp_ns), 1_000_000_000)
    types = typestore().types
    stamp = types['builtin_interfaces/msg/Time'](sec=sec, nanosec=nanosec)
    return types['std_msgs/msg/Header'](stamp=stamp, frame_id=frame_id)


def serialize(name: str, content: Any) -> bytes:
    """Return a message as CDR bytes."""
    return bytes(typestore().serialize_cdr(content, full_name(name)))


def deserialize(name: str, data: bytes, definition: str = '') -> Any:
    """Return the message that CDR bytes hold.

    Args:
        name: its type.
        data: the bytes.
        definition: ros2msg text that was kept with the bytes. Where it is another version of one
            of our types, fields that it lacks are not known: NaN, False, 0 or empty.

    Raises:
        InputError: the bytes are no message of that type.
    """
    name = full_name(name)
    old = _other_version(name, definition)
    if old is None:
        return _decode(name, data)[0]
    return _as_ours(name, _decode(name, data, old)[0], old)


def as_current(name: str, data: bytes, definition: str) -> bytes:
    """Return CDR bytes of any version of a type as those of our version.

    Raises:
        InputError: as `deserialize`.
    """
    if _other_version(full_name(name), definition) is None:
        return data
    return serialize(name, deserialize(name, data, definition))


def trimmed(name: str, data: bytes) -> bytes:
    """Return CDR bytes without what an rmw implementation sent beyond the message's end.

    Bytes that are no message of that type are returned as they are.
    """
    try:
        used = _decode(full_name(name), data)[1]
    except InputError:
        return data
    return data if len(data) - used <= 3 else data[:used]


@lru_cache(maxsize=64)
def _other_version(name: str, definition: str) -> Any:
    """Return the type store of another version of one of our types, None for the one we have.

    A text that cannot be read is ignored: the messages are taken to be of our version.
    """
    if not definition or not name.startswith(f'{PACKAGE}/'):
        return None
    ours = typestore()
    try:
        types = get_types_from_msg(definition, name)
    except (TypesysError, *_UNDECODABLE):
        return None
    types = {kind: fields for kind, fields in types.items() if kind.startswith(f'{PACKAGE}/')}
    if all(
        kind in ours.fielddefs and ours.fielddefs[kind][1] == fields[1]
        for kind, fields in types.items()
    ):
        return None
    store = get_typestore(Stores.ROS2_JAZZY)
    try:
        store.register(types)
        store.get_msgdef(name)
    except (TypesysError, *_UNDECODABLE):
        return None
    return store


def _as_ours(name: str, old: Any, version: Any) -> Any:
    """Return the message of another version as one of ours."""
    ours = typestore()
    before = dict(version.fielddefs[name][1])
    values = {}
    for field, kind in ours.fielddefs[name][1]:
        used = _message_of(kind)
        if before.get(field) != kind:
            values[field] = _not_known(kind)
        elif used is None:
            values[field] = getattr(old, field)
        elif kind[0] == Nodetype.NAME:
            values[field] = _as_ours(used, getattr(old, field), version)
        else:
            values[field] = [_as_ours(used, one, version) for one in getattr(old, field)]
    return ours.types[name](**values)


def _message_of(kind: Any) -> str | None:
    """Return the type of ours that a field holds, single or as an array; None for others."""
    inner = kind if kind[0] == Nodetype.NAME else kind[1][0]
    used = inner[1] if inner[0] == Nodetype.NAME else ''
    return str(used) if used.startswith(f'{PACKAGE}/') else None


def _not_known(kind: Any) -> Any:
    """Return the value of a field that a message lacks; our types have no fixed-length arrays."""
    if kind[0] == Nodetype.NAME:
        ours = typestore()
        fields = ours.fielddefs[kind[1]][1]
        return ours.types[kind[1]](**{field: _not_known(inner) for field, inner in fields})
    if kind[0] == Nodetype.BASE:
        base = kind[1][0]
        return _NOTHING.get(base, float('nan') if base.startswith('float') else 0)
    inner, base = kind[1][0][0], kind[1][0][1][0]
    numbers = inner == Nodetype.BASE and base != 'string'
    return np.empty(0, dtype=base if base != 'bool' else np.bool_) if numbers else []


@cache
def _definition(name: str, store: Any) -> Any:
    """Return rosbags' compiled definition of a type of a type store."""
    return store.get_msgdef(name)


def _decode(name: str, data: bytes, version: Any = None) -> tuple[Any, int]:
    """Return the message and how many bytes it takes, encapsulation included."""
    if data[:2] not in (b'\x00\x00', b'\x00\x01'):
        raise InputError(f'{len(data)} bytes are not a {name} (not plain CDR)')
    store = version or typestore()
    try:
        definition = _definition(name, store)
        decode = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
        content, used = decode(data[4:], 0, definition.cls, store)
    except _UNDECODABLE as error:
        raise InputError(f'{len(data)} bytes are not a {name} ({error})') from error
    spare = len(data) - 4 - used
    if not 0 <= spare <= MAX_SPARE:
        raise InputError(f'{len(data)} bytes are not a {name} ({spare} bytes too many)')
    return content, 4 + used
