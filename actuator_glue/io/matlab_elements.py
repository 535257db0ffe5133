"""Elements of MATLAB files up to version 7, checked before a library takes them at their word.

The library looks up types in a table and nests as deep as a file does, both unchecked: damage
may end the process there. So types, lengths and depth are looked at before.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.formats import check_size

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
# MAT-File Format (The MathWorks), table 1-1: types of data; 8, 10 and 11 are reserved.
_NUMBERS = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13}
_TYPES = {*_NUMBERS, _MATRIX, 16, 17, 18}
# Table 1-3: classes of arrays, and two that MATLAB writes but its document does not list.
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_NUMERIC = range(_SPARSE, _FUNCTION)
_SMALL = 256  # bytes of heads, which are kept
_DEEPEST = 64  # structs in cells in structs; the library keeps a frame of the stack for each
_MOST = 1_000_000  # elements: what has more is no record, and takes minutes and all memory
_STEP = 1 << 20

# Returns the next bytes, exactly as many as were asked for.
_Take = Callable[[int], bytes]


@dataclass(slots=True)
class _Source:
    """Where the next bytes come from, their order, and how many elements there were."""

    take: _Take
    order: str
    path: Path
    seen: int = 0


@dataclass(frozen=True, slots=True)
class _Element:
    """Type, bytes of data, bytes with head and padding, and the data where they are few."""

    kind: int
    length: int
    size: int
    data: bytes = b''


def check_elements(path: Path) -> None:
    """Walk through a file and refuse it where an element is not as the format has it.

    Args:
        path: the file, of version 4 to 7; a file of version 4, which has no such elements, is not
            checked.

    Raises:
        InputError: cut off, an element of an unknown type, longer than its parent, nested too
            deep, too many of them, or more inflated bytes than are read.
        zlib.error: damage in a compressed variable.
        OSError: the file cannot be read.
    """
    inflated, end = 0, path.stat().st_size
    with path.open('rb') as file:
        header = file.read(_HEADER)
        if 0 in header[:4]:
            return
        order = '<' if header[126:] == b'IM' else '>'
        plain = partial(_from_file, file, path)
        source = _Source(plain, order, path)
        while end - file.tell() >= 8:
            kind, length = _words(plain(8), order)
            if kind == _COMPRESSED:
                variable = _Inflated(plain, length, path, inflated)
                source.take = variable.take
                _check(source)
                inflated = variable.finish()
            else:
                file.seek(-8, 1)
                source.take = plain
                _check(source)


def _words(data: bytes, order: str) -> tuple[int, int]:
    first, second = np.frombuffer(data, f'{order}u4').tolist()
    return first, second


def _from_file(file: BinaryIO, path: Path, count: int) -> bytes:
    data = file.read(count)
    if len(data) < count:
        raise InputError(f'{path}: damaged, or cut off: a variable ends after the file')
    return data


def _check(source: _Source, depth: int = 0) -> _Element:
    """Walk through one element and what it holds, and return it."""
    take, order, path = source.take, source.order, source.path
    first, length = _words(take(8), order)
    source.seen += 1
    if source.seen > _MOST:
        raise InputError(f'{path}: more than {_MOST} variables in variables; save vectors')
    short = first >> 16  # up to four bytes, in the head itself
    kind = first & 0xFFFF if short else first
    if short > 4 or kind not in _TYPES:
        raise InputError(f'{path}: damaged: an element of type {first}, which MATLAB has not')
    if short:
        return _Element(kind, short, 8, np.array([length], f'{order}u4').tobytes()[:short])
    if depth > _DEEPEST:
        raise InputError(f'{path}: variables in variables, {depth} deep; save them one by one')
    left = length + -length % 8
    found = _Element(kind, length, 8 + left)
    if kind == _MATRIX:
        parts: list[_Element] = []
        while left >= 8:
            parts.append(_check(source, depth + 1))
            left -= parts[-1].size
        if left < 0 or (parts and not _whole(parts, order)):
            raise InputError(f'{path}: damaged: a variable does not hold what its head says')
    elif left <= _SMALL:
        found = replace(found, data=take(left)[:length])
        left = 0
    while left > 0:
        left -= len(take(min(left, _STEP)))
    return found


def _whole(parts: list[_Element], order: str) -> bool:
    """Whether a variable has the elements that its class asks for."""
    kinds = [part.kind for part in parts]
    # Unsigned sizes and UTF-8 names are what other programs write.
    known = len(kinds) >= 3 and kinds[0] == 6 and kinds[1] in (5, 6) and kinds[2] in (1, 16)
    if not known or len(parts[0].data) != 8 or len(parts[1].data) < 8:
        return bool(parts[0].data) and parts[0].data[0 if order == '<' else 3] == _OPAQUE
    flags, _ = _words(parts[0].data, order)
    kind, complex_numbers = flags & 0xFF, bool(flags & 0x800)
    shape = np.frombuffer(parts[1].data, f'{order}i4').tolist()
    rest, count = parts[3:], math.prod(shape)
    if kind == _OBJECT:
        rest = rest[1:]  # the name of its class
    if kind in (_STRUCT, _OBJECT):
        if len(rest) < 2 or len(rest[0].data) != 4:
            return False
        count *= rest[1].length // max(int(np.frombuffer(rest[0].data, f'{order}i4')[0]), 1)
        rest = rest[2:]
    if kind in (_CELL, _STRUCT, _OBJECT):
        return len(rest) == count and all(p.kind == _MATRIX for p in rest)
    if kind in _NUMERIC:
        count = 1 + complex_numbers + 2 * (kind == _SPARSE)
        return len(rest) == count and all(p.kind in _NUMBERS for p in rest)
    return kind == _FUNCTION or (kind == _CHAR and len(rest) == 1 and rest[0].kind != _MATRIX)


class _Inflated:
    """A compressed variable, inflated as its bytes are asked for."""

    def __init__(self, more: _Take, length: int, path: Path, before: int) -> None:
        self._more, self._left, self._path, self._given = more, length, path, before
        self._inflate = zlib.decompressobj()
        self._ready, self._at = b'', 0

    def take(self, count: int) -> bytes:
        """Return the next bytes; `InputError` where there are not as many."""
        while len(self._ready) - self._at < count:
            if not self._grow():
                raise InputError(f'{self._path}: damaged, or cut off: a variable is not whole')
        self._at += count
        return self._ready[self._at - count : self._at]

    def finish(self) -> int:
        """Go to the end, where the checksum is; return all bytes that were inflated so far."""
        while self._grow():
            self._at = len(self._ready)
        if not self._inflate.eof:
            raise InputError(f'{self._path}: damaged, or cut off: a variable is not whole')
        return self._given

    def _grow(self) -> bool:
        """Inflate some more; False where nothing is left."""
        data = self._inflate.unconsumed_tail
        if not data:
            data = self._more(min(self._left, _STEP))
            self._left -= len(data)
        found = self._inflate.decompress(data, 16 * _STEP)
        self._given += len(found)
        check_size(self._given, self._path)
        self._ready, self._at = self._ready[self._at :] + found, 0
        return bool(data or found)
