"""Numbers out of any topic of a bag, decoded by the definitions that the bag itself holds."""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, is_dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from actuator_glue.errors import InputError
from actuator_glue.io.bag_reader import BagMessage, Note, Summary, messages, refuse
from actuator_glue.records import Array
from actuator_glue.sample_block import stamp_ns

Stamps = Literal['header', 'published', 'logged']
# Elements of one array that are offered as columns; a longer one is no set of channels.
_MOST_ELEMENTS = 32
# Types end up as code in rosbags: nothing but a name may be one.
_TYPE = re.compile(r'[A-Za-z]\w*(/[A-Za-z]\w*){1,2}')
_STEP = re.compile(r'(\w+)(?:\[(\d+)\])?')


@dataclass(slots=True)
class TopicSeries:
    """Columns of one topic.

    Attributes:
        topic: its name.
        type: of its messages.
        times: by kind of stamp, [ns]; `header` only where every message has one.
        columns: values by path within the message, e.g. `wrench.force.x`, `position[0]`.
    """

    topic: str
    type: str
    times: dict[Stamps, array[int]] = field(
        default_factory=lambda: {k: array('q') for k in ('header', 'published', 'logged')}
    )
    columns: dict[str, array[float]] = field(default_factory=dict)

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
        series = found.get(message.topic)
        if series is None:
            series = found[message.topic] = TopicSeries(message.topic, message.type)
            names = [name for name, _ in _numbers(content)]
            if wanted is not None and not (topic in wanted and len(names) == 1):
                names = [name for name in names if f'{topic}.{name}' in wanted] or names
            series.columns = {name: array('d') for name in names}
        _append(series, content, message, path)
    return found


def _append(series: TopicSeries, content: Any, message: BagMessage, path: Path | str) -> None:
    header = getattr(content, 'header', None)
    stamp = stamp_ns(header) if hasattr(header, 'stamp') else 0
    series.times['header'].append(stamp)
    series.times['published'].append(message.publish_time)
    series.times['logged'].append(message.log_time)
    for name, values in series.columns.items():
        try:
            values.append(float(_value(content, name)))
        except (IndexError, AttributeError, TypeError) as error:
            raise InputError(
                f'{path}: topic {series.topic}: message {len(values)} has no {name}'
            ) from error


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


def _numbers(content: Any, prefix: str = '', depth: int = 0) -> Iterator[tuple[str, float]]:
    """Yield path and value of every number of a message; headers and longer arrays are none."""
    for name in getattr(content, '__dataclass_fields__', {}):
        value = getattr(content, name)
        where = f'{prefix}{name}'
        if name.startswith('__') or name == 'header' or isinstance(value, bool):
            continue
        if isinstance(value, (int, float)):
            yield where, float(value)
        elif isinstance(value, np.ndarray) and value.dtype.kind in 'fiu':
            if len(value) <= _MOST_ELEMENTS:
                yield from ((f'{where}[{i}]', float(v)) for i, v in enumerate(value))
        elif is_dataclass(value) and depth < 8:
            yield from _numbers(value, f'{where}.', depth + 1)


def _value(content: Any, path: str) -> Any:
    for name, index in _STEP.findall(path):
        content = getattr(content, name)
        if index:
            content = content[int(index)]
    return content
