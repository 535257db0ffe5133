"""What a file is by its first bytes: how its text is coded, or why it is no text."""

from __future__ import annotations

import codecs
import re
from pathlib import Path
from typing import Literal, TextIO

from actuator_glue.errors import InputError

_LOOK = 65_536  # bytes
_TABLE = 'save the table as .csv'
_UNPACK = 'unpack it first'
_NETCDF = 'save it as netCDF-4, which is HDF5, or as .csv'
_PICKLE = f'such a file can run programs when it is opened, and is never read: {_TABLE}'
_BAG = 'give the folder of a bag in MCAP format'
_CONVERT = '`rosbags-convert --src OLD --dst NEW --dst-storage mcap` makes one'

# First bytes, what they begin, what to do.
_SIGNATURES: tuple[tuple[bytes, str, str], ...] = (
    (b'\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1', 'an Excel workbook (.xls)', _TABLE),
    (b'PAR1', 'a Parquet file', _TABLE),
    (b'TDSm', 'a LabVIEW TDMS file', _TABLE),
    (b'ARROW1', 'an Arrow file', _TABLE),
    (b'\x93NUMPY', 'a NumPy array', _TABLE),
    (b'\x89HDF\r\n\x1a\n', 'an HDF5 file', _TABLE),
    (b'SQLite format 3\0', 'an SQLite file', f'{_BAG}; {_CONVERT} of the folder of a .db3'),
    (b'\x89MCAP0\r\n', 'an MCAP file', 'give it a name ending in .mcap, or the folder of the bag'),
    (b'#ROSBAG V', 'a ROS 1 bag', f'{_BAG}; {_CONVERT} of it'),
    (b'\x1f\x8b', 'a gzip archive', _UNPACK),
    (b'BZh', 'a bzip2 archive', _UNPACK),
    (b'\xfd7zXZ\0', 'an xz archive', _UNPACK),
    (b'(\xb5/\xfd', 'a zstd archive', _UNPACK),
    (b"7z\xbc\xaf'\x1c", 'a 7z archive', _UNPACK),
    (b'%PDF-', 'a PDF document', _TABLE),
    (b'\x89PNG', 'a picture', _TABLE),
    (b'\xff\xd8\xff', 'a picture', _TABLE),
    (b'FEA1\0', 'a Feather file', _TABLE),
    *((b'CDF' + n, 'a netCDF file of the classic kind', _NETCDF) for n in (b'\1', b'\2', b'\5')),
    *((b'\x80' + n, 'a Python pickle', _PICKLE) for n in (b'\2', b'\3', b'\4', b'\5')),
)
# Beginnings of text that is no table.
_NO_TABLE = (
    (re.compile(rb'\s*(\{\s*"|\[\s*[\[{]|\[\s*-?\d[\d.eE+-]*\s*,)'), 'JSON'),
    (re.compile(rb'\s*<(\?xml|!doctype|html|table)\b', re.IGNORECASE), 'XML or HTML'),
)
# A line of numbers alone: rows of a table, which may have a head of JSON or XML.
_ROW = re.compile(rb'^[-+.\deE]+([;,|\t ]+[-+.\deE]+)+\s*$', re.MULTILINE)
_ZIP = b'PK\x03\x04'
# What a zip archive of that kind has in its first entries.
_ZIPPED: tuple[tuple[bytes, str], ...] = (
    (b'[Content_Types].xml', 'an Excel workbook (give it a name ending in .xlsx)'),
    (b'xl/', 'an Excel workbook (give it a name ending in .xlsx)'),
    (b'opendocument', 'an OpenDocument table'),
    (b'.npy', 'a NumPy archive'),
)
# No text has these; tab, line ends, form feed, end of file and escape it may have.
_CONTROL = set(range(32)) - set(b'\t\n\v\f\r\x1a\x1b')
_MARKS = (
    (b'\xff\xfe\0\0', 'utf-32'),
    (b'\0\0\xfe\xff', 'utf-32'),
    (b'\xff\xfe', 'utf-16'),
    (b'\xfe\xff', 'utf-16'),
)


def refuse_pipe(path: Path) -> None:
    """Refuse what can be read only once: a pipe, a terminal, a device.

    A file is opened more than once: to see what it is, then for what it holds. Of a pipe the
    second look would begin in the middle.

    Raises:
        InputError: it is there, but neither a file nor a folder.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError(
            f'{path}: this is a pipe or a device, which can be read only once; save what comes '
            'out of it as a file, and give that'
        )


def beginning(path: Path) -> bytes:
    """Return the first bytes of a file.

    Raises:
        InputError: it cannot be read, or is a pipe.
    """
    refuse_pipe(path)
    try:
        with path.open('rb') as file:
            return file.read(_LOOK)
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror or error})') from error


def refuse_foreign(path: Path, wanted: str) -> bytes:
    """Return the first bytes of a file that is not known to be something else.

    Raises:
        InputError: the file cannot be read, or is of another format, which the message names.
    """
    start = beginning(path)
    what, remedy = _known(start)
    if what:
        raise InputError(f'{path}: this is {what}, not {wanted}; {remedy}')
    return start


def is_text(start: bytes) -> bool:
    """Return whether a file that begins so is text: there is something, and no byte of binary."""
    return bool(start) and _CONTROL.isdisjoint(start)


def text_encoding(path: Path) -> str:
    """Return how the text of a file is coded: UTF-8, UTF-16, UTF-32 or Windows-1252.

    Raises:
        InputError: the file cannot be read, or is no text; the message names what it is.
    """
    start = refuse_foreign(path, 'text')
    if start.startswith(b'MATLAB '):
        raise InputError(f'{path}: this is a MATLAB file; give it a name ending in .mat')
    if encoding := _wide(start):
        return encoding
    if not _CONTROL.isdisjoint(start):
        raise InputError(
            f'{path}: this is binary data of a format that is not known, not text; {_TABLE}'
        )
    try:
        codecs.getincrementaldecoder('utf-8')().decode(start)
    except UnicodeDecodeError:
        return 'cp1252'  # a few bytes are no characters in it: reported at their places
    return 'utf-8-sig'


def unmarked(start: bytes) -> bytes:
    """Return the first bytes of a text as UTF-8 has them, without a mark of its coding."""
    encoding = _wide(start)
    if encoding:
        start = start.decode(encoding, 'ignore').encode()
    return start.removeprefix(codecs.BOM_UTF8)


def _wide(start: bytes) -> str:
    """Return the coding of a text whose characters are of two bytes or four; else nothing."""
    for mark, encoding in _MARKS:
        if start.startswith(mark):
            return encoding
    # Western text in UTF-16 without a mark has a zero in every second byte.
    for zeros, encoding in ((1, 'utf-16-le'), (0, 'utf-16-be')):
        high, low = start[zeros::2], start[1 - zeros :: 2]
        if high and high.count(0) > 0.9 * len(high) and 0 not in low:
            return encoding
    return ''


def open_text(path: Path, errors: Literal['strict', 'replace'] = 'strict') -> TextIO:
    """Return a text file that is open for reading, its lines ending with a line feed.

    Lines that end CR CR LF are what Python's csv module writes on Windows into a file whose line
    ends are translated again: one line end, not two.

    Args:
        path: the file.
        errors: 'replace' where bytes that are no character of its coding may be there.

    Raises:
        InputError: the file cannot be read, or is no text, or one that holds no table.
    """
    encoding, start = text_encoding(path), beginning(path)
    plain = unmarked(start)
    for mark, what in _NO_TABLE:
        if mark.match(plain) and not _ROW.search(plain):
            raise InputError(f'{path}: this is {what}, not a table of numbers; {_TABLE}')
    doubled = '\r\r\n' in start.decode(encoding, 'replace')
    return path.open(encoding=encoding, errors=errors, newline='\n' if doubled else None)


def _known(start: bytes) -> tuple[str, str]:
    if start.startswith(_ZIP):
        for inside, what in _ZIPPED:
            if inside in start:
                return what, _TABLE
        return 'a zip archive', _UNPACK
    for mark, what, remedy in _SIGNATURES:
        if start.startswith(mark):
            return what, remedy
    return '', ''
