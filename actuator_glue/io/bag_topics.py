"""Numbers out of any topic of a bag, decoded by the definitions that the bag itself holds.

Elements of an array that a list of names goes with are called by their name, as in
`/joint_states.position[act1]`: their order may be another in each message.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, is_dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import BagMessage, Summary, messages
from actuator_glue.io.remarks import Note, refuse
from actuator_glue.records import Array
from actuator_glue.sample_block import stamp_ns

Stamps = Literal['header', 'published', 'logged']
# Elements of one array that are offered as columns; a longer one is no set of channels.
_MOST_ELEMENTS = 32
# Types end up as code in rosbags: nothing but a name may be one.
_TYPE = re.compile(r'[A-Za-z]\w*(/[A-Za-z]\w*){1,2}')
_STEP = re.compile(r'(\w+)(?:\[([^\]]+)\])?\.?')
# Fields that hold a list of names: `name` of a JointState, `joint_names`, `labels`.
_NAMES = re.compile(r'(^|_)(names?|labels?|ids?)$')
_DEEPEST = 8  # messages in messages


class _FieldStep(NamedTuple):
    """A step into a message: a field, and which element of it where it is an array."""

    field: str
    key: int | str | None = None
    # For an element by its name: how many levels up the list of names is, and its field.
    up: int = 0
    names: str = ''


class _Place(NamedTuple):
    """Where a number of a message is: the steps to it.

    And the names of the elements that are taken by number, and the path by these names.
    """

    steps: list[_FieldStep]
    called: list[str]
    by_name: str


@dataclass(slots=True)
class TopicSeries:
    """Columns of one topic.

    Attributes:
        topic: its name.
        type: of its messages.
        times: by kind of stamp, [ns]; `header` only where every message has one.
        columns: values by path within the message, e.g. `wrench.force.x`, `position[act1]`.
    """

    topic: str
    type: str
    times: dict[Stamps, array[int]] = field(
        default_factory=lambda: {k: array('q') for k in ('header', 'published', 'logged')}
    )
    columns: dict[str, array[float]] = field(default_factory=dict)
    _asked: bool = False
    # Of each column, in the first message.
    _places: dict[str, _Place] = field(default_factory=dict)

    def names(self) -> list[str]:
        """Return what a channel map calls the columns; the topic alone where there is but one."""
        return [f'{self.topic}.{path}' for path in self.columns]

    def column(self, name: str) -> Array | None:
        """Return the column of a name, None where it is none of this topic."""
        if name == self.topic and len(self.columns) == 1:
            return np.array(next(iter(self.columns.values())))
        found = self.columns.get(name.removeprefix(f'{self.topic}.'))
        return None if found is None or name == self.topic else np.array(found)

    def seconds(self, kind: Stamps, zero: int) -> Array:
        """Return the stamps as seconds since a time [ns]."""
        since: Array = (np.array(self.times[kind], dtype=np.int64) - zero) * np.float64(1e-9)
        return since


def topic_series(
    path: Path | str, wanted: Collection[str] | None = None, note: Note = refuse
) -> dict[str, TopicSeries]:
    """Return the numbers of a bag's topics.

    Args:
        path: bag folder or lone .mcap.
        wanted: names of columns, `TOPIC` or `TOPIC.PATH`; every number of every topic where None,
            topics that cannot be decoded left out.
        note: called with one line per damage; the default raises it.

    Raises:
        InputError: no bag, damage, or a wanted topic whose messages cannot be decoded.
    """
    summary = Summary()
    found: dict[str, TopicSeries] = {}
    decoders: dict[str, Callable[[bytes], Any]] = {}
    skipped: set[str] = set()
    for message in messages(path, note=note, summary=summary):
        topic = message.topic
        if topic in skipped:
            continue
        if wanted is not None and not any(n == topic or n.startswith(f'{topic}.') for n in wanted):
            skipped.add(topic)
            continue
        try:
            if message.type not in decoders:
                decoders[message.type] = _decoder(message.type, summary)
            content = decoders[message.type](message.data)
        except Exception as error:  # a parser's, a decoder's: whatever the bytes make of them
            if wanted is None:
                skipped.add(topic)
                continue
            raise InputError(
                f'{path}: topic {message.topic} ({message.type}) cannot be decoded ({error})'
            ) from error
        series = found.get(topic)
        if series is None:
            series = found[topic] = TopicSeries(topic, message.type)
            _begin(series, content, wanted)
        _append(series, content, message, path)
    return {topic: series for topic, series in found.items() if series.columns}


def _begin(series: TopicSeries, content: Any, wanted: Collection[str] | None) -> None:
    """Choose the columns of a topic by its first message."""
    paths = offered = list(_numbers(content))
    if wanted is not None:
        asked = [n.removeprefix(f'{series.topic}.') for n in wanted]
        paths = [path for path in asked if _place(content, path)]
        if series.topic in wanted and len(offered) == 1:
            paths = offered
        series._asked = bool(paths)
        paths = paths or offered  # to say what there is
    series._places = {path: place for path in paths if (place := _place(content, path))}
    series.columns = {path: array('d') for path in series._places}


def _append(series: TopicSeries, content: Any, message: BagMessage, path: Path | str) -> None:
    """Append one message; a column that it lacks is left out where nobody asks for it.

    Raises:
        InputError: a column that is wanted is not there, or may be another channel's.
    """
    header = getattr(content, 'header', None)
    stamp = stamp_ns(header) if hasattr(header, 'stamp') else 0
    series.times['header'].append(stamp)
    series.times['published'].append(message.publish_time)
    series.times['logged'].append(message.log_time)
    for name, values in list(series.columns.items()):
        place = series._places[name]
        try:
            values.append(float(_value(content, place.steps)))
        except (IndexError, AttributeError, TypeError, ValueError) as error:
            if not series._asked:
                del series.columns[name]
                continue
            raise InputError(
                f'{path}: topic {series.topic}: message {len(values)} has no {name}'
            ) from error
        now = _place(content, name) if series._asked and place.called else None
        if now is not None and now.called and now.called != place.called:
            raise InputError(
                f'{path}: topic {series.topic}: {name} is {place.called[-1]!r} in the first '
                f'message and {now.called[-1]!r} in message {len(values) - 1}; choose the channel '
                f'by its name: {series.topic}.{place.by_name}'
            )


def _decoder(name: str, summary: Summary) -> Callable[[bytes], Any]:
    """Return what decodes messages of a type: by the bag's definition, else by ROS 2 Jazzy's."""
    if not _TYPE.fullmatch(name):
        raise ValueError('no name of a message type')
    text = summary.definitions.get(name, '')
    store: Typestore = get_typestore(Stores.EMPTY if text.strip() else Stores.ROS2_JAZZY)
    if text.strip():
        idl = text.lstrip('=\n ').startswith('IDL:')
        store.register(get_types_from_idl(text) if idl else get_types_from_msg(text, name))
    return lambda data: store.deserialize_cdr(data, name)


def _numbers(content: Any, prefix: str = '', above: tuple[Any, ...] = ()) -> Iterator[str]:
    """Yield the path of every number of a message; headers and longer arrays are none."""
    levels = (*above, content)
    for name in getattr(content, '__dataclass_fields__', {}):
        value = getattr(content, name)
        where = f'{prefix}{name}'
        if name.startswith('__') or name == 'header' or isinstance(value, bool):
            continue
        if isinstance(value, (int, float)):
            yield where
        elif is_dataclass(value) and len(levels) <= _DEEPEST:
            yield from _numbers(value, f'{where}.', levels)
        elif isinstance(value, (list, np.ndarray)) and 0 < len(value) <= _MOST_ELEMENTS:
            names = _names(levels, len(value))
            keys = [str(i) for i in range(len(value))] if names is None else names[2]
            if isinstance(value, np.ndarray) and value.dtype.kind in 'fiu':
                yield from (f'{where}[{key}]' for key in keys)
            elif names and is_dataclass(value[0]) and len(levels) <= _DEEPEST:
                for key, element in zip(keys, value, strict=True):
                    yield from _numbers(element, f'{where}[{key}].', levels)


def _names(levels: tuple[Any, ...], size: int) -> tuple[int, str, list[str]] | None:
    """Return the names that go with an array of a message: levels up, field, names.

    The nearest list of so many names, no two alike, none that would be taken for a number.
    """
    for up, level in enumerate(reversed(levels)):
        for name in level.__dataclass_fields__:
            held = getattr(level, name)
            if _NAMES.search(name) and isinstance(held, list) and len(held) == size:
                plain = all(isinstance(n, str) and n and ']' not in n for n in held)
                if plain and len(set(held)) == size and not any(n.isdigit() for n in held):
                    return up, name, held
    return None


def _place(content: Any, path: str) -> _Place | None:
    """Return where a number of a message is; None where there is none."""
    steps: list[_FieldStep] = []
    called: list[str] = []
    levels: tuple[Any, ...] = ()
    by_name = ''
    if ''.join(match[0] for match in _STEP.finditer(path)) != path:
        return None
    for name, key in _STEP.findall(path):
        levels = (*levels, content)
        if name not in getattr(content, '__dataclass_fields__', {}):
            return None
        content = getattr(content, name)
        by_name += f'.{name}'
        if not key:
            steps.append(_FieldStep(name))
            continue
        if not isinstance(content, (list, np.ndarray)):
            return None
        up, field_of_names, names = _names(levels, len(content)) or (0, '', [])
        if key.isdigit() and int(key) < len(content):
            at = int(key)
            steps.append(_FieldStep(name, at))
            called += names[at : at + 1]
        elif key in names:
            at = names.index(key)
            steps.append(_FieldStep(name, key, up, field_of_names))
        else:
            return None
        content = content[at]
        by_name += f'[{names[at] if names else key}]'
    number = isinstance(content, (int, float, np.number)) and not isinstance(content, bool)
    return _Place(steps, called, by_name[1:]) if number else None


def _value(content: Any, steps: list[_FieldStep]) -> Any:
    """Return the number at the end of some steps.

    Raises:
        IndexError, AttributeError, TypeError, ValueError: it is not there in this message.
    """
    levels = []
    for name, key, up, names in steps:
        levels.append(content)
        content = getattr(content, name)
        if isinstance(key, str):
            key = getattr(levels[-1 - up], names).index(key)
        if key is not None:
            content = content[key]
    return content
