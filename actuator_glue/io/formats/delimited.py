"""Columns of numbers out of delimited text."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import Literal, TextIO

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.io.channel_map import ChannelMap
from actuator_glue.io.file_notes import take_note
from actuator_glue.io.formats import Column, FileTable, Format
from actuator_glue.io.noted_rate import may_be_thousands, take_rate
from actuator_glue.io.signature import open_text
from actuator_glue.io.units import EXAMPLE, bare, is_unit, kinds_line, units_line
from actuator_glue.records import Array

_ROWS = 10_000  # rows read or written at a time
_LOOK = 100  # rows that tell how a text is laid out
_ENDS = 200  # last rows that tell whether a text was cut off within its last number
_SHOWN = 60  # characters of a line in a message
_BROKEN = 10  # lines over which the names may go on: spreadsheets break lines within cells
# A comma may be the decimal sign where there is another delimiter, so it comes behind the usual
# ones.
DELIMITERS = (';', '\t', ',', '|')
_NOTHING = ' \r\n\x1a'  # all that a line without entries may hold; DOS ends a file with the last
# A number as texts have it, with any decimal sign; its case is ignored.
NUMBER = r'[+-]?(?:(?:\d+{sign}?\d*|{sign}\d+)(?:[ed][+-]?\d+)?|nan|inf(?:inity)?)'
_NUMBER = re.compile(NUMBER.format(sign=r'\.'), re.ASCII | re.IGNORECASE)
_FORTRAN = re.compile(r'(?<=[\d.])[dD](?=[+-]?\d)')  # the exponent of a double: 1.5D-3
# Digits in groups of three, as thousands are written; a decimal fraction may look like it.
_GROUPED = re.compile(r'[+-]?[1-9]\d{0,2}(?:[.,]\d{3})+', re.ASCII)
_MONTHS = ('jan', 'feb', 'mar', 'apr', 'may', 'jun', 'jul', 'aug', 'sep', 'oct', 'nov', 'dec')
# A date whose order is known: year first, dots behind the day, or a month by its name. Of any
# other, such as 05/03/2024, only the time of day is taken. Durations may have days in front.
_STAMP = re.compile(
    r'(?:(?:(?P<year>\d{4})[-/.](?P<month>\d\d)[-/.](?P<day>\d\d)'
    r'|(?P<day_2>\d{1,2})\.(?P<month_2>\d{1,2})\.(?P<year_2>\d{4})'
    rf'|(?P<day_3>\d{{1,2}})[- ](?P<name>{"|".join(_MONTHS)})[- ](?P<year_3>\d{{4}})'
    r'|\d{1,2}[-/.]\d{1,2}[-/.](?:\d{4}|\d\d)|(?P<days>\d+) days?)(?:T|,? ))?'
    r'(?P<hour>\d{1,2})(?P<clock>:\d\d:\d\d)(?:(?:[.,]|:(?=\d{3}\b))(?P<fraction>\d+))?'
    r'(?: ?(?P<half>[ap])\.?m\.?)?(?: ?(?P<zone>Z|UTC|GMT|[+-]\d\d:?\d\d))?',
    re.ASCII | re.IGNORECASE,
)
# The same in ISO 8601, without a zone.
_ISO = re.compile(r'(?:(?:19[7-9]\d|20\d\d)-\d\d-\d\d[T ])?\d\d:\d\d:\d\d(?:\.\d{1,9})?', re.ASCII)
_ZERO = re.compile(r'[.,]\d*0(?:e|$)', re.IGNORECASE)  # a number written with all its digits
# What parts names with blanks within them, as in `Time [s]  Command [mm]`.
_BLANKS, _NO_BRACKET = re.compile(r'\s{2,}'), re.compile(r'\s+(?![\[(\s])')
_WORD = re.compile(r'"((?:[^"]|"")*)"|(\S+)')
_QUOTED_FIRST = re.compile(r'\s*"[^"]*"\s*[;,\s]\s*[^"\s]')
_OPEN = re.compile(r'(?:^|[;\t,|])\s*"[^"]*$')  # a quoted entry that does not end in its line
_SPREADSHEET = re.compile(r'"?sep=(.)"?', re.IGNORECASE)  # a first line that says the delimiter
# Numbers of a fixed width without a blank between them, and what to do.
_TOUCHING = re.compile(r'\d[+-]\d|\.\d+\.\d')
_TOUCH = 'numbers touch each other: save them with a delimiter, or in wider columns'
# What begins a comment: `#` as numpy writes it, `%` as MATLAB does.
_COMMENT = re.compile(r'\s*(?:#[#\s]*|%+\s+)')
# Names of columns that go up by themselves: a running number below one may be its values.
_GOES_UP = re.compile(
    r'time|zeit|sample|index|count|number|row|step|^(nr|no|id|t|i|n|#)\b', re.IGNORECASE
)
# Names of columns of text behind the numbers, which are often left out.
_REMARKS = re.compile(r'event|comment|remark|note|marker|message|kommentar|bemerkung', re.I)
Decimal = Literal['.', ',']


@dataclass(frozen=True, slots=True)
class TextHead:
    """What the lines before the samples say, and how the samples are laid out.

    Attributes:
        names: one for each entry of a row, empty for a running number that has none; nothing
            where the line of names does not fit the rows, or there is none.
        units: of the columns, where a line below the names holds them.
        lines: lines before the first sample.
        delimiter: text between columns, None for blanks.
        notes: `# name = value` lines; `# name: value` if nearly one of `NOTES`, or a sample rate.
        decimal: decimal sign of the samples.
        width: entries of a row.
        least: entries that a row has at least; the last ones may be remarks, and left out.
        stamps: positions of columns that hold dates or times of day.
        named: entries of the line of names, whether it fits or not.
        rows: samples that are read; None for all.
        timed: a column has times or counts samples.
    """

    names: list[str]
    units: list[str]
    lines: int
    delimiter: str | None
    notes: dict[str, str]
    decimal: Decimal
    width: int
    least: int
    named: int
    stamps: frozenset[int] = frozenset()
    rows: int | None = None
    timed: bool = False


def read_head(
    path: Path,
    header_lines: int | None = None,
    delimiter: str | None = None,
    decimal: Decimal | None = None,
) -> TextHead:
    """Return the head of a file.

    Args:
        path: the file.
        header_lines: lines before the first sample, the last naming the columns; None where
            comments (`#`, `%`) and one line of names are all there is.
        delimiter: text between columns, found by itself where None.
        decimal: decimal sign, found by itself where None.

    Raises:
        InputError: the file cannot be read, is no text or is empty.
    """
    with open_text(path, errors='replace') as file:
        top = [line.rstrip('\r\n') for line in islice(file, (header_lines or _LOOK) + _LOOK)]
    if not any(line.strip() for line in top):
        raise InputError(f'{path}: the file is empty')
    notes: dict[str, str] = {}
    units: list[str] = []
    if header_lines is None:
        if (said := _SPREADSHEET.fullmatch(top[0].strip())) is not None:
            delimiter = delimiter or said[1]
        header_lines, line, units = _find_names(path, top, int(said is not None), notes)
    elif len(top) < header_lines:
        raise InputError(f'{path}: {len(top)} lines, but {header_lines} header lines expected')
    else:
        firsts = range(max(header_lines - _BROKEN, 0), header_lines - 1)
        broken = (i for i in firsts if _broken(top[i:header_lines]))
        line = ' '.join(top[next(broken, max(header_lines - 1, 0)) : header_lines])
        line = uncommented(line)
        for above in top[:header_lines]:
            if _COMMENT.match(above):
                take_note(uncommented(above), notes, str(path))
            else:
                take_rate(above, notes)
    if line and not units:
        header_lines, line, units = _below_names(path, top, header_lines, line, delimiter, notes)
    if units and header_lines < len(top):
        kinds = fields_of(top[header_lines], delimiter or _of_units(line, top[header_lines]))
        header_lines += len(kinds) == len(units) and kinds_line(kinds)
    rows = [text for text in top[header_lines:] if text.strip(_NOTHING)] or [line]
    rows = [text for text in rows if not _COMMENT.match(text)] or rows
    if delimiter is None:
        delimiter = _best_delimiter(line, rows[0])
    table = [fields_of(row, delimiter) for row in rows]
    _refuse_left_out(path, top, header_lines)
    widths = {len(row) for row in table}
    names = _names(line, delimiter, widths)
    if delimiter is None and len(names) == max(widths) and _behind_index(line, rows, table):
        names = _BLANKS.split(line.strip())
    width = max(widths)
    if len(names) in widths or all(map(_REMARKS.search, names[width:] or [''])):
        width = len(names)
    aligned = names if len(names) == width else _aligned(names, table, rows, line)
    least = _least_width(aligned, table, width)
    if aligned and not aligned[0] and len(units) == width - 1:
        units = ['', *units]
    if any(units[width:]):  # it is unknown which column each belongs to
        units = []
    units = [*units, *[''] * (width - len(units))][:width]
    sign = decimal or _decimal([entry for row in table for entry in row])
    stamps = frozenset(at for at, entry in enumerate(table[0]) if is_stamp(entry))
    if sign == ',':
        notes = {n: v for n, v in notes.items() if not may_be_thousands(n, v)}
    return TextHead(
        aligned, units, header_lines, delimiter, notes, sign, width, least, len(names), stamps
    )


def _refuse_left_out(path: Path, top: list[str], header_lines: int) -> None:
    """Refuse a table as it is printed when it is long.

    Raises:
        InputError: dots stand for rows.
    """
    for number, text in enumerate(top[header_lines:], header_lines + 1):
        if set(text) <= {'.', ' '} and '..' in text:
            raise InputError(
                f'{path}: line {number} is of dots: rows are left out there; save all of them, '
                'for instance with `to_csv` or `to_string` of pandas'
            )


def _find_names(
    path: Path, top: list[str], at: int, notes: dict[str, str]
) -> tuple[int, str, list[str]]:
    """Return the lines before samples or a line of units, the line of names, and their units.

    Where the names are in comments, the units may be in a comment below them.
    """
    comments = ['']
    while at < len(top) and (_COMMENT.match(top[at]) or not top[at].strip(_NOTHING)):
        comment = uncommented(top[at])
        if comment.strip() and not take_note(comment, notes, str(path)):
            comments.append(comment)
        at += 1
    if at == len(top):
        return at, *_commented_units(comments[-2:])
    entries = fields_of(top[at], _best_delimiter('', top[at]))
    if len(entries) < 2 or not all(map(is_number, entries)):
        ends = range(at + 1, min(at + _BROKEN, len(top)) + 1)
        stop = next((end for end in ends if _broken(top[at:end])), at + 1)
        return stop, ' '.join(top[at:stop]), []
    if entries in ([str(i + start) for i in range(len(entries))] for start in (0, 1)):
        raise InputError(
            f'{path}: line {at + 1} may be a sample or the numbers of the columns; say which in '
            f'a channel map, with `header_lines: {at}` or `header_lines: {at + 1}`'
        )
    # Numbers are no names but the first sample; numpy.savetxt puts names behind a `#`.
    return at, *_commented_units(comments[-2:])


def _below_names(
    path: Path, top: list[str], at: int, line: str, delimiter: str | None, notes: dict[str, str]
) -> tuple[int, str, list[str]]:
    """Return the lines before samples, the line of names, and the units below it."""
    for below in range(at, len(top)):
        text = uncommented(top[below])
        by = delimiter or _of_units(line, text)
        entries = fields_of(text, by)
        if units := units_line(entries):
            return below + 1, line, units
        numbers = sum(map(is_number, entries))
        # A number behind a `#` may be that of a sample.
        if _COMMENT.match(top[below]) and (
            numbers < 2 or len(entries) != len(fields_of(line, by))
        ):
            take_note(text, notes, str(path))
            at = below + 1
        elif not numbers and names_index(text, line):
            return below + 1, text.rstrip() + line[len(text.rstrip()) :], []
        elif text.strip(_NOTHING):
            break
    return at, line, []


def names_index(text: str, names: str) -> bool:
    """Whether a line stands below the blanks in front of the names, as pandas prints an index."""
    return text.strip() != '' and not names[: len(text.rstrip())].strip()


def _broken(lines: list[str]) -> bool:
    """Whether a name in quotes begins in the first of some lines and one ends in the last.

    Other names may be broken off and go on in lines between. A single quote may mean inches.
    """
    odd = [line.count('"') % 2 for line in lines]
    return odd == [1, *[0] * (len(lines) - 2), 1] and _OPEN.search(lines[0]) is not None


def _commented_units(comments: list[str]) -> tuple[str, list[str]]:
    """Return the line of names of the last two comments, and the units in one below it."""
    above, last = ['', *comments][-2:]
    delimiter = next((d for d in DELIMITERS if d in last), None)
    units = units_line(fields_of(last, delimiter))
    if units and len(fields_of(above, delimiter)) == len(units):
        return above, units
    return last, []


def uncommented(line: str) -> str:
    """Return a line without what makes it a comment."""
    mark = _COMMENT.match(line)
    return line if mark is None else line[mark.end() :]


def _best_delimiter(names: str, row: str) -> str | None:
    """Return what parts a row, None for blanks: as many names as entries, and most numbers."""

    def fit(delimiter: str | None) -> tuple[bool, int]:
        entries = fields_of(row, delimiter)
        missing = len(entries) - len(fields_of(names, delimiter))
        return len(entries) > 1 and missing in (0, 1), 2 * sum(map(is_number, entries)) - len(
            entries
        )

    return max((*DELIMITERS, None), key=fit)


def _of_units(names: str, units: str) -> str | None:
    """Return what parts a line of units, None for blanks: units may have blanks within them."""
    for delimiter in DELIMITERS:
        if 1 < len(fields_of(names, delimiter)) == len(fields_of(units, delimiter)):
            return delimiter
    return None if all(map(is_unit, units.split())) else _best_delimiter(names, units)


def _names(line: str, delimiter: str | None, widths: set[int]) -> list[str]:
    names = fields_of(line, delimiter)
    # The names that numpy.savetxt writes behind its `#` may have another delimiter than the rows.
    own = fields_of(line, next((d for d in DELIMITERS if d in line), None))
    names = own if len(own) in widths else names
    if len(names) > max(widths) and delimiter is not None and '"' not in line:
        # As in `Position(8800 (0,1):Position) (mm)`, without quotes.
        whole = re.split(re.escape(delimiter) + r'(?![^()\[\]]*[)\]])', line)
        names = [name.strip() for name in whole] if len(whole) in widths else names
    if len(names) > max(widths) and delimiter is None:
        parted = [by.split(line.strip()) for by in (_BLANKS, _NO_BRACKET)]
        names = next((found for found in parted if max(widths) - len(found) in (0, 1)), names)
    while len(names) > max(widths) and not names[-1]:
        names = names[:-1]
    return names


def _behind_index(line: str, rows: list[str], table: list[list[str]]) -> bool:
    """Whether a printed table has an index without a name, and one name of two words.

    These are as many words as entries, but the first begins behind the first entries.
    """
    ends = [_ends(row, entries) for row, entries in zip(rows, table, strict=True)]
    first = len(line) - len(line.lstrip())
    printed = all(some and some[0] <= first and some[1:] == ends[0][1:] for some in ends)
    return printed and len(_BLANKS.split(line.strip())) == len(table[0]) - 1


def _aligned(names: list[str], table: list[list[str]], rows: list[str], line: str) -> list[str]:
    """Return a name for each entry of rows with one entry more than names; nothing if unclear.

    The extra entry is a running number without a name in front, as R and pandas write it, or an
    empty entry behind a delimiter that ends each row. Where they print a table, each name ends
    above its numbers.
    """
    if not names or any(len(row) != len(names) + 1 for row in table):
        return []
    ends = _ends(line, names)
    if ends and all(_ends(*row)[1:] == ends for row in zip(rows, table, strict=True)):
        return ['', *names]
    counts = len(table) > 1 and all(row[0].isdecimal() for row in table)
    if counts:
        first = int(table[0][0])
        counts = all(int(row[0]) == first + i for i, row in enumerate(table))
    own = _GOES_UP.search(names[0]) is not None
    if (own or not counts) and not any(row[-1] for row in table):
        return [*names, '']
    # Where the first name may be that of the running number, only quotes tell.
    if counts and (not own or all(map(_QUOTED_FIRST.match, rows))):
        return ['', *names]
    return []


def _ends(line: str, entries: list[str]) -> list[int]:
    """Return where each entry of a line ends; nothing where more than blanks part them."""
    at, found = 0, []
    for entry in entries:
        start = line.find(entry, at)
        if start < 0 or line[at:start].strip():
            return []
        at = start + len(entry)
        found.append(at)
    return found


def _least_width(names: list[str], table: list[list[str]], width: int) -> int:
    """Return how many entries a row has at least: columns of remarks at its end may be left out.

    Where a number is left out nothing tells which one it was.
    """
    least = width
    while least > 2:
        entries = [row[least - 1] for row in table if len(row) >= least]
        remarks = any(entries) and not any(map(is_number, entries))
        if not remarks and not (names and not any(entries) and _REMARKS.search(names[least - 1])):
            break
        least -= 1
    return least


def _decimal(entries: list[str]) -> Decimal:
    commas = [e for e in entries if ',' in e and is_number(e)]
    points = [e for e in entries if '.' in e and is_number(e)]
    if not commas or (points and all(map(_GROUPED.fullmatch, commas))):
        return '.'
    return ',' if all(map(_GROUPED.fullmatch, points)) else '.'


def is_number(entry: str) -> bool:
    """Return whether an entry is a number, whatever its decimal sign."""
    return _NUMBER.fullmatch(entry.strip().replace(',', '.', 1)) is not None


def is_stamp(entry: str) -> bool:
    """Return whether an entry is a time of day, with a date or without one."""
    return _STAMP.fullmatch(entry.strip()) is not None


def _seconds(entry: str) -> float:
    """Return seconds since 1970 (UTC where no zone is written), or of the day; NaN for neither."""
    stamp = _STAMP.fullmatch(entry.strip())
    if stamp is None:
        return np.nan
    year, month, day = (
        next(filter(None, map(stamp.group, names)), None)
        for names in (
            ('year', 'year_2', 'year_3'),
            ('month', 'month_2'),
            ('day', 'day_2', 'day_3'),
        )
    )
    if stamp['name']:
        month = str(1 + _MONTHS.index(stamp['name'].lower()))
    hour, half = int(stamp['hour']), (stamp['half'] or '').lower()
    if half and not 1 <= hour <= 12:
        return np.nan
    if half:
        hour = hour % 12 + (12 if half == 'p' else 0)
    date = '1970-01-01' if year is None else f'{year}-{month or "":0>2}-{day or "":0>2}'
    zone = (stamp['zone'] or 'UTC').upper().replace('UTC', 'Z').replace('GMT', 'Z')
    try:
        whole = datetime.fromisoformat(f'{date}T{hour:02d}{stamp["clock"]}{zone}')
    except ValueError:  # 25:00:00
        return np.nan
    passed = 86_400.0 * float(stamp['days'] or 0)
    return passed + whole.timestamp() + float(f'0.{stamp["fraction"] or 0}')


def seconds_of(entries: list[str]) -> Array:
    """Return the seconds that entries stamp, shape (n,); NaN for what is no stamp.

    They are read at once where all are written alike, as ISO 8601 without a zone.
    """
    if len(set(map(len, entries))) == 1 and all(map(_ISO.fullmatch, entries)):
        day = '' if '-' in entries[0] else '1970-01-01T'
        with suppress(ValueError):  # 25:00:00
            times = np.array([day + entry for entry in entries], dtype='datetime64[ns]')
            whole = times.astype('datetime64[s]')
            return np.asarray(whole.astype(np.float64) + (times - whole).astype(np.float64) / 1e9)
    return np.array(list(map(_seconds, entries)))


def fields_of(line: str, delimiter: str | None) -> list[str]:
    """Return the entries of a line without the quotes about them."""
    if not line.strip(_NOTHING):
        return []
    if delimiter is None:
        words = _WORD.finditer(line) if '"' in line else ()
        return [m[1] if m[2] is None else m[2] for m in words] or line.split()
    if '"' not in line or len(delimiter) != 1:  # csv takes one character
        return [entry.strip().strip('"') for entry in line.split(delimiter)]
    blanks = delimiter != ' '
    try:
        (entries,) = csv.reader([line], delimiter=delimiter, skipinitialspace=blanks, strict=True)
    except csv.Error:  # a quote that does not end would take what follows for one entry
        return [line]
    return [entry.strip() for entry in entries]


def read_columns(path: Path, head: TextHead, positions: list[int]) -> list[Array]:
    """Return columns of numbers at positions from 0, each of shape (n,); no number is NaN.

    Raises:
        InputError: a row has another number of entries than the first, there is no row, or no
            such column.
    """
    if max(positions) >= head.width:
        raise InputError(
            f'{path}: cannot read the samples: rows have {head.width} entries, column '
            f'{max(positions) + 1} is asked for'
        )
    parts: list[list[Array]] = [[] for _ in positions]
    last: list[tuple[int, str]] = []
    try:
        with open_text(path) as file:
            rows = _rows(file, head)
            while block := list(islice(rows, _ROWS)):
                last = [*last, *block][-_ENDS:]
                for part, column in zip(parts, _block(path, block, head, positions), strict=True):
                    part.append(column)
    except UnicodeDecodeError as error:
        raise InputError(
            f'{path}: not plain text in {error.encoding} (byte {error.start}); save it as UTF-8'
        ) from error
    _refuse_cut(path, head, last)
    if not parts[0]:
        raise InputError(f'{path}: no samples after the {head.lines} header lines')
    columns = []
    for part in parts:  # one after the other: of a long file not everything is there twice
        columns.append(np.concatenate(part))
        part.clear()
    if head.rows is not None and len(columns[0]) < head.rows:
        raise InputError(
            f'{path}: {len(columns[0])} samples after the {head.lines} header lines, and the '
            f'channel map says `rows: {head.rows}`'
        )
    return columns


def _refuse_cut(path: Path, head: TextHead, rows: list[tuple[int, str]]) -> None:
    """Refuse a text that ends within its last number: a digit may be missing, or an exponent.

    It has no line end there, and the number fewer digits behind its decimal sign than all before,
    of which some end in zeros: without these they are as long as they come.

    Args:
        path: the file.
        head: its head.
        rows: the last ones of the samples, with their numbers.

    Raises:
        InputError: it does.
    """
    if len(rows) < _ENDS or rows[-1][1].endswith('\n'):
        return
    entries = [fields_of(line, head.delimiter)[-1] for _, line in rows]
    *usual, found = [len(entry.partition(head.decimal)[2]) for entry in entries]
    cut = len(set(usual)) == 1 and found < usual[0] and any(map(str.isdigit, entries[-1]))
    if cut and all(map(is_number, entries[:-1])) and any(map(_ZERO.search, entries[:-1])):
        raise InputError(
            f'{path}: the file is cut off within its last number, {entries[-1]!r} in line '
            f'{rows[-1][0]} (those before it have {usual[0]} characters behind the decimal sign, '
            'and a line end); copy it anew, or remove that line'
        )


def _rows(file: TextIO, head: TextHead) -> Iterator[tuple[int, str]]:
    """Yield line numbers from 1 and the rows that are read."""
    return islice(_all_rows(file, head), head.rows)


def _all_rows(file: TextIO, head: TextHead) -> Iterator[tuple[int, str]]:
    """Yield line numbers from 1 and rows: no empty lines, at the end no rows of empty entries.

    Nor comments at the end; elsewhere one may stand for a sample, which only a clock tells.
    """
    empty = _NOTHING + ('\t' if head.delimiter is None else '')
    parted = empty + (head.delimiter or '') + '"'
    held: list[tuple[int, str]] = []
    for number, line in enumerate(islice(file, head.lines, None), head.lines + 1):
        if is_remark(line, head.delimiter, head.least):
            held += [] if head.timed else [(number, line)]
        elif line.strip(parted):
            if held:
                yield from held
                held.clear()
            yield number, line
        elif line.strip(empty):
            held.append((number, line))


def is_remark(line: str, delimiter: str | None, width: int) -> bool:
    """Return whether a line is a comment, and no row of so many entries behind a `#`."""
    if (mark := _COMMENT.match(line)) is None:
        return False
    entries = fields_of(line[mark.end() :], delimiter)
    # Of blanks a sentence has as many.
    return len(entries) < width or sum(map(is_number, entries)) < 2


def _block(
    path: Path, block: list[tuple[int, str]], head: TextHead, positions: list[int]
) -> list[Array]:
    """Return some columns of some rows.

    Raises:
        InputError: a row has more or fewer entries than the first of the file.
    """
    delimiter, lines = head.delimiter, [line for _, line in block]
    plain = delimiter is None or len(delimiter) == 1
    plain = plain and not head.stamps.intersection(positions)
    if plain and head.decimal == ',':  # with a point in it an entry is no number
        plain = delimiter != ',' and not any('.' in line for line in lines)
        lines = [line.replace(',', '.') for line in lines] if plain else lines
    if plain and not any('"' in line for line in lines):
        _check_widths(
            path,
            head,
            block,
            [len(line.split()) for line in lines]
            if delimiter is None
            else [line.count(delimiter) + 1 for line in lines],
        )
        try:
            table: Array = np.loadtxt(
                lines, delimiter=delimiter, usecols=positions, ndmin=2, comments=None
            )
        except ValueError:
            pass  # an entry is no number: it is found below
        else:
            return [np.array(column) for column in table.T]
    rows = [fields_of(line, delimiter) for _, line in block]
    _check_widths(path, head, block, [len(row) for row in rows])
    entries = [[row[at] if at < len(row) else '' for row in rows] for at in positions]
    return [
        seconds_of(column) if at in head.stamps else _numbers(column, head.decimal)
        for at, column in zip(positions, entries, strict=True)
    ]


def _check_widths(
    path: Path, head: TextHead, block: list[tuple[int, str]], widths: list[int]
) -> None:
    if head.least <= min(widths) and max(widths) <= head.width:
        return
    for width, (number, line) in zip(widths, block, strict=True):
        if head.least <= width <= head.width:
            continue
        remarks = fields_of(line, head.delimiter)[head.least :]
        if head.least < head.width and width > head.width and not any(map(is_number, remarks)):
            continue  # several remarks with the delimiter between them
        if head.delimiter is None and width < head.least and _TOUCHING.search(line):
            raise InputError(
                f'{path}: cannot read the samples: {_TOUCH}, in line {number} '
                f'({line.strip()[:_SHOWN]!r})'
            )
        raise InputError(
            f'{path}: cannot read the samples: line {number} has {width} entries, other rows '
            f'have {head.width}: a column would be shifted, or the file is cut off there; mend or '
            f'remove that line ({line.strip()[:_SHOWN]!r}); where another block of samples begins '
            'there, `actuator-glue map` proposes which to read'
        )


def _numbers(entries: list[str], decimal: Decimal) -> Array:
    """Return numbers, NaN for what is none."""
    text = '\n'.join(entries)
    if decimal == ',':  # a point makes the entry no number: dropping it would change the value
        text = text.replace('.', '?').replace(',', '.')
    text = _FORTRAN.sub('e', text)
    entries = text.split('\n')
    if text.isascii() and '_' not in text:  # `float` accepts more than files mean
        try:
            return np.array(list(map(float, entries)))
        except ValueError:
            pass
    return np.array(
        [float(e) if _NUMBER.fullmatch(e.strip()) is not None else np.nan for e in entries]
    )


def entry_at(path: Path, head: TextHead, row: int, position: int) -> str:
    """Return where the file has an entry, and what it is, for messages."""
    with open_text(path, errors='replace') as file:
        number, line = next(islice(_rows(file, head), row, None))
    entries = [*fields_of(line, head.delimiter), *[''] * head.width]
    said = f'line {number}: {entries[position][:_SHOWN]!r}'
    other, decimal = ('.', 'comma') if head.decimal == ',' else (',', 'point')
    if other in entries[position] and is_number(entries[position].replace(other, '')):
        return f'{said} ({other!r} where the {decimal} is decimal: export it without thousands)'
    return said


def _refuse_groups(path: Path, head: TextHead, at: list[int], columns: list[Array]) -> None:
    """Refuse a column whose numbers may be thousands or have a fraction: 1.234 between 56 and 78.

    Raises:
        InputError: nothing in the whole column tells which.
    """
    for position, values in zip(at, columns, strict=True):
        whole = values == np.rint(values)
        broken = np.abs(values[~whole & np.isfinite(values)])
        milli = 1e3 * broken
        if (
            not len(broken)
            or not whole.any()
            or broken.min() < 1.0
            or broken.max() >= 1000.0
            or np.abs(milli - np.rint(milli)).max() > 1e-6
        ):
            continue
        if (grouped := _grouped(path, head, position)) is not None:
            raise InputError(
                f'{path}: column {position + 1}: {grouped!r} may be '
                f'{grouped.replace(head.decimal, "")} or a fraction, and nothing in the column '
                'tells which; save the numbers without thousands separators, or say `decimal` in '
                'a channel map'
            )


def _grouped(path: Path, head: TextHead, position: int) -> str | None:
    """Return the first number of a column with a decimal sign, if all may be thousands.

    Some number has no such sign then; the first that has it and is no thousand ends the look.
    """
    first, whole = None, False
    with open_text(path) as file:
        for _, line in _rows(file, head):
            for entry in fields_of(line, head.delimiter)[position : position + 1]:
                if head.decimal not in entry:
                    whole = True
                elif _GROUPED.fullmatch(entry) is None:
                    return None
                else:
                    first = first or entry
    return first if whole else None


def _read(path: Path, channels: ChannelMap | None) -> FileTable:
    if channels is None:
        head = read_head(path)
        if not head.named:
            raise InputError(
                f'{path}: the first line must name the columns with their units, as in '
                f'{EXAMPLE}; or describe the file with --channels MAP.yaml'
            )
        by_name, timed = True, any(bare(name) == 'time' for name in head.names)
    else:
        head = replace(
            read_head(path, channels.header_lines, channels.delimiter, channels.decimal),
            rows=channels.rows,
        )
        wanted = [channel.column for channel in channels.roles().values()]
        by_name = any(isinstance(column, str) for column in (*wanted, channels.sample_number))
        timed = channels.time is not None or channels.sample_number is not None
    head = replace(head, timed=timed)
    if by_name and head.named and not head.names:
        touching = head.delimiter is None and head.width < head.named
        raise InputError(
            f'{path}: cannot read the samples: {head.named} names, but {head.width} entries in '
            'the first row; give each column a name, or describe the file with --channels '
            'MAP.yaml, which `actuator-glue map` proposes' + f'; if {_TOUCH}' * touching
        )
    stated = channels is not None and channels.decimal is not None

    def values(at: list[int]) -> list[Array]:
        columns = read_columns(path, head, at)
        if not stated:
            _refuse_groups(path, head, at, columns)
        return columns

    names = head.names or [''] * head.width
    return FileTable(
        [
            # pandas writes stamps of the index without a name, in front.
            Column(name, bare(name) or 'time' * (at == 0), 's')
            if at in head.stamps
            else Column(name, name, unit)
            for at, (name, unit) in enumerate(zip(names, head.units, strict=True))
        ],
        head.notes,
        values,
        entry=lambda row, at: entry_at(path, head, row, at),
    )


def _write(path: Path, columns: Mapping[str, Array], notes: Mapping[str, str | float]) -> None:
    table = np.column_stack(list(columns.values()))
    with path.open('w', encoding='utf-8', newline='\n') as file:
        for name, value in notes.items():
            file.write(f'# {name} = {value}\n')
        file.write(','.join(columns) + '\n')
        for start in range(0, len(table), _ROWS):
            rows = table[start : start + _ROWS].tolist()
            file.writelines(','.join(map(repr, row)) + '\n' for row in rows)


FORMAT = Format(('.csv',), _read, _write)
