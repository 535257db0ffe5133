"""Read bags: ours, those of `ros2 bag record -s mcap`, and lone .mcap files, cut ones too."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from actuator_glue.errors import InputError
from actuator_glue.io import bag_metadata
from actuator_glue.io.bag_metadata import BagFile, BagTopic
from actuator_glue.io.mcap_scan import COMPRESSED, Scan, plain
from actuator_glue.io.messages import deserialize, full_name
from actuator_glue.io.remarks import Note, refuse

TEST_SETUP = full_name('TestSetup')
# Messages held back for a set-up recorded late: as many as sample blocks may wait on their topic.
WAITING = 2000


class BagMessage(NamedTuple):
    """One serialized message of a bag; times in ns.

    `definition` is the ros2msg text that the bag holds of its type.
    """

    topic: str
    type: str
    data: bytes
    log_time: int
    publish_time: int
    definition: str = ''


@dataclass(slots=True)
class Summary:
    """What a bag holds, counted from its data.

    Attributes:
        topics: by name, in order of appearance.
        definitions: ros2msg text by type.
        parts: one per file.
        finished: the bag has all its files, each with its end, and metadata.yaml where it is
            a folder.
        damage: one line per damage.
    """

    topics: dict[str, BagTopic] = field(default_factory=dict)
    definitions: dict[str, str] = field(default_factory=dict)
    parts: list[BagFile] = field(default_factory=list)
    finished: bool = True
    damage: list[str] = field(default_factory=list)


def is_bag(path: Path | str) -> bool:
    """Return whether a path is a bag folder or a lone .mcap."""
    path = Path(path)
    if path.is_dir():
        return (path / bag_metadata.NAME).exists() or any(path.glob('*.mcap'))
    return _is_mcap(path)


def _is_mcap(path: Path) -> bool:
    """Return whether a file is called as one in MCAP format, plain or compressed as a whole."""
    return path.suffix == '.mcap' or path.suffixes[-2:] == ['.mcap', COMPRESSED]


def bag_files(path: Path | str, note: Note = refuse) -> list[Path]:
    """Return the .mcap files of a bag in the order they were recorded.

    Args:
        path: bag folder or lone .mcap.
        note: called with one line per missing file.

    Raises:
        InputError: no such bag, or not in MCAP format.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f'{path}: there is no such bag')
    if not path.is_dir():
        return [path]
    information: dict[str, object] | None = None
    try:
        information = bag_metadata.read(path)
    except InputError as error:
        note(str(error))
    present = sorted(path.glob('*.mcap'), key=_by_number)
    if information is None:
        if not present:
            others = ', '.join(sorted(p.name for p in path.iterdir())[:5]) or 'nothing'
            raise InputError(
                f'{path}: this folder is no bag in MCAP format (it holds {others}); record with '
                '`ros2 bag record -s mcap`, or convert a sqlite3 bag with `ros2 bag convert`'
            )
        return present
    names = information['relative_file_paths']
    assert isinstance(names, list)
    files = [path / Path(name).name for name in names]
    foreign = [f.name for f in files if not _is_mcap(f)]
    if foreign:
        raise InputError(
            f'{path}: {foreign[0]} is not in MCAP format; convert the bag with `ros2 bag convert` '
            'to storage_id mcap, or with `rosbags-convert --src OLD --dst NEW --dst-storage mcap`'
        )
    for file in files:
        if not file.exists():
            note(f'{path}: {file.name} of metadata.yaml is missing')
    return [f for f in files if f.exists()]


def _by_number(path: Path) -> tuple[int, str]:
    number = re.search(r'(\d+)$', path.stem)
    return (int(number.group(1)) if number else -1, path.name)


def messages(
    path: Path | str,
    *,
    types: Collection[str] | None = None,
    topics: Collection[str] | None = None,
    note: Note = refuse,
    summary: Summary | None = None,
) -> Iterator[BagMessage]:
    """Yield the messages of a bag in the order they were recorded; memory does not grow.

    Args:
        path: bag folder or lone .mcap.
        types: full names of the types wanted, all where None.
        topics: topics wanted, all where None.
        note: called with one line per damage (cut off, damaged chunk, missing file); the default
            raises it once everything before has been yielded.
        summary: filled while reading, whatever the filters.

    Raises:
        InputError: no bag, or damage without `note`.
    """
    for file in bag_files(path, note):
        scan = Scan(file, note)
        texts: dict[int, str] = {}
        part = BagFile(file.name)
        if summary is not None:
            summary.parts.append(part)
        for schema, channel, message in scan.messages():
            if schema.id not in texts:
                texts[schema.id] = schema.data.decode('utf-8', 'replace')
            if summary is not None:
                if channel.topic not in summary.topics:
                    summary.topics[channel.topic] = BagTopic(
                        channel.topic,
                        schema.name,
                        channel.metadata.get('topic_type_hash', ''),
                        bag_metadata.qos_profiles(
                            channel.metadata.get('offered_qos_profiles', '')
                        ),
                        encoding=channel.message_encoding,
                    )
                    summary.definitions[schema.name] = texts[schema.id]
                summary.topics[channel.topic].count += 1
                part.add(message.log_time)
            if (types is None or schema.name in types) and (
                topics is None or channel.topic in topics
            ):
                try:
                    data = plain(channel, message)
                except ValueError as error:
                    note(f'{file}: topic {channel.topic}: a message is damaged ({error})')
                    continue
                yield BagMessage(
                    channel.topic,
                    schema.name,
                    data,
                    message.log_time,
                    message.publish_time,
                    texts[schema.id],
                )
        if summary is not None and not scan.finished:
            summary.finished = False


def as_published(found: Iterable[BagMessage]) -> Iterator[BagMessage]:
    """Yield recorded messages with each set-up before the samples published after it.

    Topics have no order among each other: a recorder that stalls may take samples first. Within a
    topic the recorded order stays, whatever a clock did. Bags without times of publication come
    as they are.
    """
    waiting: deque[BagMessage] = deque()
    try:
        for message in found:
            place = len(waiting)
            if message.type == TEST_SETUP:
                while place and (before := waiting[place - 1]).type != TEST_SETUP:
                    if before.publish_time <= message.publish_time:
                        break
                    place -= 1
            waiting.insert(place, message)
            if len(waiting) > WAITING:
                yield waiting.popleft()
    except InputError:
        yield from waiting
        raise
    yield from waiting


def summarise(path: Path | str) -> Summary:
    """Return what a bag holds; damage is noted, never raised.

    Raises:
        InputError: no bag at all.
    """
    summary = Summary()
    for _ in messages(path, types=(), note=summary.damage.append, summary=summary):
        pass
    path = Path(path)
    if path.is_dir() and not (path / bag_metadata.NAME).exists():
        summary.finished = False
        if not summary.damage:
            summary.damage.append(f'{path}: {bag_metadata.NAME} is missing')
    return summary


def decoded(
    path: Path | str,
    names: Collection[str],
    *,
    counted: Collection[str] = (),
    topics: Collection[str] | None = None,
    note: Note = refuse,
) -> Iterator[tuple[str, Any]]:
    """Yield (type name, message) of the wanted types in the order of `as_published`.

    Args:
        path: bag folder or lone .mcap.
        names: types, bare names for those of actuator_glue_msgs.
        counted: types of which only the place is wanted: None stands for each message.
        topics: topics wanted, all where None.
        note: as in `messages`.

    Raises:
        InputError: no bag, damage without `note`, or bytes that are no such message.
    """
    places = {full_name(name) for name in counted}
    types = {full_name(name) for name in names} | places
    for found in as_published(messages(path, types=types, topics=topics, note=note)):
        if found.type in places:
            yield found.type, None
            continue
        yield found.type, content(found, path)


def content(found: BagMessage, path: Path | str) -> Any:
    """Return what a message of a bag says.

    Raises:
        InputError: its bytes are no message of its type.
    """
    try:
        return deserialize(found.type, found.data, found.definition)
    except InputError as error:
        raise InputError(
            f'{path}: topic {found.topic}: {error}; was it recorded with another version of the '
            'messages?'
        ) from error
