"""Mend bags that were cut off: a killed recorder, a full disk, an incomplete copy."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from mcap.opcode import Opcode

from actuator_glue.errors import InputError
from actuator_glue.io import bag_metadata
from actuator_glue.io.bag_metadata import BagTopic, Metadata
from actuator_glue.io.bag_reader import Summary, bag_files, messages
from actuator_glue.io.mcap_file import DiskError, McapFile, Message, disk_error, in_use
from actuator_glue.io.mcap_scan import COMPRESSED, UNREADABLE, Scan

KEPT = '.cut'  # suffix of the original of a file that was written anew
MESSAGES_IN_MEMORY = 1000  # while a file is written anew


@dataclass(slots=True)
class Recovery:
    """What recovering a bag did.

    Attributes:
        messages: messages in the mended bag.
        seconds: from the first to the last message [s].
        rewritten: files written anew; the original of each stays beside it as `NAME.mcap.cut`.
        notes: what was wrong, one line each.
    """

    messages: int = 0
    seconds: float = 0.0
    rewritten: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def recover(path: Path | str) -> Recovery:
    """Write cut or damaged files of a bag anew from what is whole in them, and its metadata.yaml.

    Each file is written beside the old one and renamed into its place when it is on the disk;
    the original stays as `NAME.mcap.cut`. A bag that is whole is left as it is.

    Args:
        path: bag folder or lone .mcap.

    Raises:
        InputError: no bag, one that is being recorded or compressed as a whole, not one whole
            message, or no room.
    """
    path = Path(path)
    for file in bag_files(path, lambda _: None):
        if file.suffix == COMPRESSED:
            raise InputError(f'{file} is compressed as a whole; unpack it first (zstd -d)')
        if in_use(file):
            raise InputError(f'{file} is being recorded; stop the recorder first')
    recovery, metadata = Recovery(), Metadata()
    topics: dict[str, BagTopic] = {}
    for file in bag_files(path, recovery.notes.append):
        summary = mend(file, path)
        recovery.notes += summary.damage
        metadata.parts += summary.parts
        for topic in summary.topics.values():
            topics.setdefault(topic.name, replace(topic, count=0)).count += topic.count
        if _is_cut(summary):
            recovery.rewritten.append(file.name)
    metadata.topics = list(topics.values())
    metadata.parts = [part for part in metadata.parts if part.count]
    if not metadata.parts:
        detail = f' ({recovery.notes[0]})' if recovery.notes else ''
        raise InputError(
            f'{path}: not one whole message can be recovered{detail}; copy it again from where it '
            'was recorded, if it is whole there'
        )
    recovery.messages = sum(part.count for part in metadata.parts)
    start = min(part.start for part in metadata.parts)
    recovery.seconds = (max(part.stop for part in metadata.parts) - start) * 1e-9
    if path.is_dir() and (recovery.notes or not (path / bag_metadata.NAME).exists()):
        if not (path / bag_metadata.NAME).exists():
            recovery.notes.append(f'{path}: {bag_metadata.NAME} was missing')
        try:
            metadata.write(path)
        except OSError as error:
            raise disk_error(path, error) from error
    return recovery


def mend(file: Path, bag: Path) -> Summary:
    """Write a file of a bag anew where it is cut or damaged; return what is whole in it.

    Raises:
        InputError: no room.
    """
    summary = Summary()
    for _ in messages(file, types=(), note=summary.damage.append, summary=summary):
        pass
    if _is_cut(summary):
        own = Metadata(list(summary.topics.values()), summary.parts)
        _rewrite(file, bag, own)
    return summary


def _is_cut(summary: Summary) -> bool:
    """Whether a file of which something is whole has to be written anew."""
    return bool(summary.parts[0].count and (summary.damage or not summary.finished))


def _rewrite(file: Path, bag: Path, own: Metadata) -> None:
    """Write a file anew from its whole messages and put it in the old one's place."""
    temporary = file.with_name(file.name + '.tmp')
    with suppress(FileNotFoundError):
        temporary.unlink()
    serialized = own.serialized()
    new = McapFile(temporary, bag)
    scan = Scan(file, lambda _: None, beside=partial(_copy_beside, new))
    topics: dict[int, BagTopic] = {}
    try:
        # Everything as it is: types of others, what has no schema, compressed messages.
        for schema, channel, message in scan.messages():
            topic = topics.get(channel.id)
            if topic is None:
                encoding = channel.message_encoding
                topic = BagTopic(channel.topic, schema.name, '', [], encoding=encoding)
                topics[channel.id] = topic
                new.add_channel(topic, schema, channel.metadata)
            new.write(Message(topic, message.data, message.log_time, message.publish_time))
            if len(new.unsure) >= MESSAGES_IN_MEMORY:
                new.flush()
        new.finish(serialized)
    except DiskError:
        with suppress(OSError):
            temporary.unlink()
        raise
    try:
        # A second name first, so that there is no moment without the file.
        _unused(file).hardlink_to(file)
        temporary.replace(file)
    except OSError as error:
        raise disk_error(bag, error) from error


def _copy_beside(new: McapFile, opcode: int, body: bytes) -> None:
    """Copy an attachment or others' metadata of a file; that of rosbag2 is written anew."""
    with suppress(*UNREADABLE):
        if opcode != Opcode.METADATA or b'rosbag2' not in body[:16]:
            new.add_beside(opcode, body)


def _unused(file: Path) -> Path:
    """Return a name for the original that no earlier recovery has taken."""

    def names() -> Iterator[Path]:
        yield file.with_name(file.name + KEPT)
        number = 2
        while True:
            yield file.with_name(f'{file.name}{KEPT}{number}')
            number += 1

    return next(name for name in names() if not name.exists())
