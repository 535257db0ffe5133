"""Scan one .mcap front to back, whether finished, cut off or damaged.

mcap's own readers either need the index at the end of a file or hand over half a message at a
cut. Here every record is checked for being whole, and messages of a cut chunk are salvaged.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, cast

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Message, Schema

from actuator_glue.errors import InputError
from actuator_glue.io.signature import refuse_pipe

COMPRESSED = '.zstd'  # suffix of a file that rosbag2 has compressed as a whole
_MAGIC = b'\x89MCAP0\r\n'
_HEAD = struct.Struct('<BQ')
_MESSAGE = struct.Struct('<HIQQ')  # channel, sequence, log time, publish time; then the data
_MAX_CHUNK = 1 << 29  # bytes; a chunk that claims more is damaged or hostile
_PIECE = 1 << 20  # bytes unpacked at once where only their number counts
# Schema of a channel whose messages have none, as JSON and plain bytes may.
NO_SCHEMA = Schema(id=0, data=b'', encoding='', name='')
_ZSTD = b'(\xb5/\xfd'
UNREADABLE = (McapError, struct.error, ValueError, RuntimeError, OverflowError, MemoryError)


@dataclass(slots=True)
class Scan:
    """State of a scan.

    Attributes:
        path: the file.
        note: called with one line per damage; raises where damage must not be passed over.
        schemas: schemas seen so far, by id.
        channels: channels seen so far, by id.
        finished: the file has its footer.
        position: first byte that is not read yet.
        orphans: messages without a known topic.
        count: whole messages so far.
        beside: called with each whole attachment and metadata record, opcode and content.
    """

    path: Path
    note: Callable[[str], None]
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    finished: bool = False
    position: int = 0
    orphans: int = 0
    count: int = 0
    beside: Callable[[int, bytes], None] = lambda opcode, body: None

    def messages(self, follow: bool = False) -> Iterator[tuple[Schema, Channel, Message]]:
        """Yield schema, channel and message in file order.

        Args:
            follow: the file is still being written: yield what is whole since the last call.

        Raises:
            InputError: the file cannot be opened, is no MCAP file, or is a pipe.
        """
        refuse_pipe(self.path)
        try:
            with self.path.open('rb') as file:
                if self.path.suffix == COMPRESSED:
                    yield from self._unpacked(file)
                else:
                    yield from self._file(file, self.path.stat().st_size, follow)
        except OSError as error:
            raise InputError(f'{self.path}: cannot be read ({error.strerror})') from error

    def _unpacked(self, packed: BinaryIO) -> Iterator[tuple[Schema, Channel, Message]]:
        """Yield the messages of a file that rosbag2 or another tool has compressed as a whole.

        Raises:
            InputError: it is no such file.
        """
        import zstandard

        head = packed.read(32)
        try:
            size = zstandard.frame_content_size(head) if head.startswith(_ZSTD) else None
        except zstandard.ZstdError:
            size = None
        if size is None:
            raise InputError(
                f'{self.path}: this is no file that rosbag2 has compressed; unpack it first'
            )
        # A frame says its own size, if any: whoever compresses while writing cannot, and there may
        # be several frames.
        size = _unpacked_size(packed)
        if not size:
            self.note(f'{self.path}: cut off or damaged before the first of it can be unpacked')
            return
        packed.seek(0)
        try:
            unpacker = zstandard.ZstdDecompressor()
            with unpacker.stream_reader(packed, read_across_frames=True) as file:
                yield from self._file(cast('BinaryIO', file), size, False)
        except zstandard.ZstdError as error:
            self.note(f'{self.path}: cut off or damaged ({error}); what comes behind is lost')

    def _file(
        self, file: BinaryIO, size: int, follow: bool
    ) -> Iterator[tuple[Schema, Channel, Message]]:
        if not _MAGIC.startswith(file.read(len(_MAGIC))):
            raise InputError(f'{self.path}: this is not an MCAP file')
        file.seek(max(self.position, len(_MAGIC)))
        while not self.finished:
            at = file.tell()
            head = file.read(_HEAD.size)
            opcode, length = _HEAD.unpack(head) if len(head) == _HEAD.size else (0, size)
            body = b''
            whole = at + _HEAD.size + length <= size
            if follow and not whole:
                return
            if opcode == Opcode.FOOTER and whole:
                self.finished = True
            elif opcode == Opcode.CHUNK or (opcode in _PARSED and whole):
                body = file.read(min(length, _MAX_CHUNK))
            elif opcode in _BESIDE and whole:
                self.beside(opcode, file.read(min(length, _MAX_CHUNK)))
            elif whole:
                file.seek(length, 1)
            if body and opcode == Opcode.CHUNK:
                for each in self._chunk(body, at, whole):
                    self.count += 1
                    yield each
            elif body and (found := self._record(opcode, body, at)) is not None:
                self.count += 1
                yield found
            self.position = file.tell()
            if not whole:
                self.note(self._cut(size))
                return

    def _cut(self, size: int) -> str:
        """Return what is said of a file that ends within a record, or before the first."""
        if not size:
            return f'{self.path}: is empty (0 bytes): there is nothing to recover'
        held = f'with {self.count} whole messages; `actuator-glue recover` mends it'
        if not self.count:
            held = 'without one whole message: there is nothing to recover'
        why = 'a killed recorder, a full disk or an incomplete copy'
        return f'{self.path}: cut off after {size} bytes ({why}), {held}'

    def _record(self, opcode: int, body: bytes, at: int) -> tuple[Schema, Channel, Message] | None:
        """Take a schema or channel; return a message with both, where there is one to be used."""
        try:
            if opcode == Opcode.MESSAGE:
                # By hand: there are many, and mcap's stream takes five times as long.
                number, sequence, logged, published = _MESSAGE.unpack_from(body)
                channel, data = self.channels[number], body[_MESSAGE.size :]
                message = Message(number, logged, data, published, sequence)
                schema = self.schemas[channel.schema_id] if channel.schema_id else NO_SCHEMA
                return schema, channel, message
            stream = ReadDataStream(BytesIO(body))
            if opcode == Opcode.SCHEMA:
                schema = Schema.read(stream)
                self.schemas[schema.id] = schema
            else:
                channel = Channel.read(stream)
                self.channels[channel.id] = channel
        except KeyError:
            if not self.orphans:
                self.note(f'{self.path}: messages from byte {at} on belong to no known topic')
            self.orphans += 1
        except UNREADABLE as error:
            self.note(f'{self.path}: damaged record at byte {at} ({error})')
        return None

    def _chunk(
        self, body: bytes, at: int, whole: bool
    ) -> Iterator[tuple[Schema, Channel, Message]]:
        try:
            data = _chunk_data(body, whole)
        except UNREADABLE as error:
            if whole:
                self.note(f'{self.path}: damaged chunk at byte {at} ({error}); left out')
                self._learn_topics()
            return
        position = 0
        while position + _HEAD.size <= len(data):
            opcode, length = _HEAD.unpack_from(data, position)
            start = position + _HEAD.size
            position = start + length
            if position > len(data):
                if whole:
                    self.note(f'{self.path}: damaged chunk at byte {at}')
                return
            if opcode in _PARSED:
                found = self._record(opcode, data[start:position], at)
                if found is not None:
                    yield found

    def _learn_topics(self) -> None:
        """Take topics from the end of the file: a damaged chunk may have held them."""
        try:
            with self.path.open('rb') as file:
                summary = make_reader(file).get_summary()
        except (OSError, *UNREADABLE):
            return
        if summary is not None:
            self.schemas = summary.schemas | self.schemas
            self.channels = summary.channels | self.channels


_BESIDE = frozenset((Opcode.ATTACHMENT, Opcode.METADATA))
_PARSED = frozenset((Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE))


def _unpacked_size(packed: BinaryIO) -> int:
    """Return how many bytes a compressed file holds, up to where it is cut off or damaged.

    A pass of its own, in memory that does not grow: without the size a cut could not be told.
    """
    import zstandard

    packed.seek(0)
    size = 0
    try:
        unpacker = zstandard.ZstdDecompressor()
        with unpacker.stream_reader(packed, closefd=False, read_across_frames=True) as file:
            while count := len(file.read(_PIECE)):
                size += count
    except zstandard.ZstdError:
        pass  # `_file` says that it ends there
    return size


def _chunk_data(body: bytes, whole: bool) -> bytes:
    """Return the records of a chunk; of a cut uncompressed one, those that are there."""
    stream = ReadDataStream(BytesIO(body))
    if not whole:
        # An uncompressed chunk's records follow its 40-byte head; a compressed one is lost.
        (compression_length,) = struct.unpack_from('<I', body, 28)
        if compression_length:
            raise ValueError('compressed')
        return body[40:]
    chunk = Chunk.read(stream)
    if chunk.uncompressed_size > _MAX_CHUNK:
        raise ValueError(f'claims {chunk.uncompressed_size} bytes')
    data = _decompress(chunk)
    if len(data) != chunk.uncompressed_size:
        raise ValueError(f'{len(data)} bytes instead of {chunk.uncompressed_size}')
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError('checksum does not agree')
    return data


def plain(channel: Channel, message: Message) -> bytes:
    """Return the data of a message, unpacked where rosbag2 has compressed it.

    CDR begins with a zero byte, so that data beginning like zstd are zstd.

    Raises:
        ValueError: it is compressed, but not whole.
    """
    data: bytes = message.data
    if channel.message_encoding != 'cdr' or not data.startswith(_ZSTD):
        return data
    import zstandard

    try:
        size = zstandard.frame_content_size(data)
    except zstandard.ZstdError as error:  # cut off within its head
        raise ValueError(str(error)) from error
    if not 0 <= size <= _MAX_CHUNK:
        raise ValueError(f'a compressed message claims {size} bytes')
    return _of_zstd(data, size)


def _of_zstd(data: bytes, size: int) -> bytes:
    """Return what is compressed, so many bytes at most.

    Raises:
        ValueError: it is damaged, or not whole.
    """
    import zstandard

    try:
        with zstandard.ZstdDecompressor().stream_reader(data) as reader:
            found = bytes(reader.read(size))
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from error
    if len(found) != size:
        raise ValueError(f'{len(found)} bytes instead of {size}')
    return found


def _decompress(chunk: Chunk) -> bytes:
    if chunk.compression == '':
        return bytes(chunk.data)
    if chunk.compression == 'zstd':
        return _of_zstd(chunk.data, chunk.uncompressed_size)
    if chunk.compression == 'lz4':
        import lz4.frame

        with lz4.frame.LZ4FrameDecompressor() as decompressor:
            return bytes(decompressor.decompress(chunk.data, chunk.uncompressed_size))
    raise ValueError(f'compression {chunk.compression!r} is unknown')
