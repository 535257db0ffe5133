"""Ground motions from files: PEER's AT2, and delimited text.

The unit of an acceleration is part of what the file says: in the name of its column, in a line of
units below the names, or as `units of g`. A unit that is said and not understood is refused; words
that are no unit say none.
"""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.given import path as path_given
from actuator_glue.hybrid.ground_motion import GroundMotion, artificial
from actuator_glue.io.remarks import Note, warn_caller
from actuator_glue.io.signature import text_encoding
from actuator_glue.io.units import ROLES, is_unit, symbol
from actuator_glue.records import Array

GRAVITY = 9.80665  # m/s^2
_LARGEST = 200_000_000  # bytes
_NUMBER = re.compile(r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?')
_UNEVEN = 0.02  # share of the sample period
# Factors to m/s^2, by units as `_plain` writes them.
_UNITS = {
    **dict.fromkeys(('g', "g's", 'gs'), GRAVITY),
    '%g': 0.01 * GRAVITY,
    'mg': 1e-3 * GRAVITY,
    **dict.fromkeys(('gal', 'gals'), 1e-2),
    'mgal': 1e-5,
}
for _unit, _length in {'m': 1.0, 'cm': 1e-2, 'mm': 1e-3, 'in': 0.0254, 'ft': 0.3048}.items():
    _UNITS |= dict.fromkeys((f'{_unit}/s2', f'{_unit}/s/s', f'{_unit}s-2'), _length)
    _UNITS |= dict.fromkeys((f'{_unit}ps2', f'{_unit}s2'), _length)
_LISTED = 'g, gal, m/s^2, cm/s^2, mm/s^2, in/s^2 or ft/s^2'
_MEND = f'name the columns `time_s,acceleration_UNIT` with {_LISTED}'
_TIME = re.compile(r'(?:time|zeit|temps|tiempo|t|sec(?:ond)?s?|s)(?![a-z])', re.IGNORECASE)
_OTHER = re.compile(
    r'(?<![a-z])(?:veloc\w*|vel|speed|geschw\w*|displ\w*|disp|dis|weg|posit\w*|force|kraft)(?![a-z])',
    re.IGNORECASE,
)
_ACCELERATION = re.compile(r'(?<![a-z])(?:acc|beschl)', re.IGNORECASE)
_BRACKETS = re.compile(r'[\[({]\s*([^\[\](){}]*?)\s*[\])}]')
# `units of g`, `Units: s, cm/s2`: what is behind it in its line.
_SAID = re.compile(r'\bunits?(?:\s+of\s+|\s*[:=]\s*)(.+)', re.IGNORECASE)
# `acceleration in g`, but not the largest one.
_IN_PROSE = re.compile(r'(?<!peak )(?<!max )(?<!max\. )\baccel\w*\.?\s+in\s+([^\s,;()]+)', re.I)
_LAST = re.compile(r',\s*([^\s,;()]+)\s*$', re.MULTILINE)  # `Record of El Centro, g`
_ABOUT = re.compile(r'time|acc\w*|and|in|of|is|are', re.IGNORECASE)  # words among units
# No earthquake is recorded in minutes, and `h` is a direction.
_TIMES = {unit: seconds for unit, seconds in ROLES['time'].items() if seconds <= 1.0}
_NOT_SECONDS = re.compile(
    r'min(?:utes?)?|h|hrs?|hours?|d|days?|samples?|steps?|ticks?|frames?|h+:m+.*', re.IGNORECASE
)
_VELOCITIES = frozenset(('kine', 'mph', 'kph', 'mps', 'cmps', 'mmps', 'ips', 'fps'))
# Which of several directions a column is, behind its `_`: no unit.
_DIRECTION = re.compile(
    r'[xyznsewuhvl]|ns|ew|ud|up|vert(ical)?|hor(izontal)?|[hxyz]\d|\d+|ground|base|input',
    re.IGNORECASE,
)


def read_ground_motion(given: Path | str, warn: Note = warn_caller) -> GroundMotion:
    """Return the ground motion of a file, or an artificial one.

    Args:
        given: 'artificial' or 'artificial:SEED'; a file of PEER's AT2 format; or delimited text
            with columns of time and acceleration. Units are those that the heading says (time in
            s where it says none); where it says no unit of acceleration, or there is no heading,
            it is m/s^2.
        warn: called with a line where that had to be taken.

    Raises:
        InputError: no such file, one that holds no ground motion, a unit that is not understood,
            or another quantity than acceleration.
    """
    name, _, seed = str(given).partition(':')
    path = path_given(given)
    if name == 'artificial' and not path.exists():
        if seed and not seed.isdigit():
            raise InputError(f'{given}: {seed!r} is no seed; give artificial:1 for example')
        return artificial(int(seed or 1))
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(f'{path}: is no ground motion but {path.stat().st_size} bytes')
        text = path.read_text(text_encoding(path))
    except OSError as error:
        raise InputError(
            f'{path}: ground motion cannot be read ({error.strerror}); give a file, or artificial'
        ) from error
    except UnicodeDecodeError as error:
        raise InputError(f'{path}: ground motion is not text in UTF-8') from error
    found = re.search(r'\bDT\s*=\s*(' + _NUMBER.pattern + ')', text[:2000], re.IGNORECASE)
    if found is not None and not _is_table(text, _float(found.group(1))):
        return _at2(path, text, _float(found.group(1)))
    return _columns(path, text, warn)


def _float(text: str) -> float:
    return float(text.replace('D', 'E').replace('d', 'e'))


def _row(line: str) -> list[float]:
    """Return the numbers of a line; empty where it is not of numbers."""
    try:
        return [_float(v) for v in re.split(r'[,;\s]+', line.strip().strip(',;'))]
    except ValueError:
        return []


def _plain(unit: str) -> str:
    """Return a unit as `_UNITS` has it: small, without brackets, powers and seconds in one way."""
    unit = unit.strip(' \t"\'[](){}.,;').lower().replace('²', '2').replace('⁻', '-')
    unit = re.sub(r'\s*([/*^·])\s*', r'\1', unit.replace('**', '^'))
    unit = re.sub(r'_?(?:\bper\b|_per_|_)\s*', '/', unit)
    unit = re.sub(r'sec(?:ond)?s?', 's', unit)
    unit = re.sub(r'\b(?:inch|inches)\b', 'in', re.sub(r'\b(?:feet|foot)\b', 'ft', unit))
    unit = re.sub(r's/(-?2)$', r's\1', unit)  # `m_s_2`
    return re.sub(r'[\s*·^.]', '', unit).replace('/s-2', '/s2')


def _like_a_unit(text: str) -> bool:
    """Whether a word that is no unit of acceleration is one of something else, or built as one."""
    text = text.strip(' \t"\'[](){}.,;')
    if _DIRECTION.fullmatch(text) or ' ' in text:
        return False
    parts = [w for w in re.findall(r'[^\W\d_]+', text) if w.lower() not in ('ns', 'ew', 'ud')]
    built = re.search(r'[/^]', text) and any(is_unit(w) or is_unit(w.lower()) for w in parts)
    return bool(built) or is_unit(text) or text.lower() in _VELOCITIES


def _listed(line: str) -> tuple[str, str]:
    """Return the units of time and of acceleration that a list of units holds; empty for none."""
    time = ''
    for word in re.split(r'[\s,;()]+', line):
        bare = word.strip('[](){}.:"\'')
        if symbol(bare) in _TIMES and not time:
            time = symbol(bare)
        elif bare == 'SI' or _plain(bare) in _UNITS or _like_a_unit(bare):
            return time, bare
        elif bare and not _ABOUT.fullmatch(bare):
            break
    return time, ''


def _is_table(text: str, period: float) -> bool:
    """Whether rows of a text that says its DT are a time and a value each."""
    first = [*islice(filter(None, map(_row, text.splitlines())), 3)]
    if len(first) < 3 or any(len(row) != 2 for row in first):
        return False
    steps = np.diff([time for time, _ in first])
    return bool((np.abs(steps - period) <= _UNEVEN * period).all())


def _at2(path: Path, text: str, period: float) -> GroundMotion:
    """Return PEER's: a heading that ends with NPTS and DT, then accelerations, row by row."""
    lines = text.splitlines()
    heading = next(i for i, line in enumerate(lines) if re.search(r'\bDT\s*=', line, re.I))
    factor = _of_heading(path, lines[: heading + 1])
    if factor is None:
        raise InputError(
            f'{path}: an AT2 file says `UNITS OF G`; this one does not: write its unit there, '
            f'{_LISTED}'
        )
    try:
        values = np.array([_float(v) for line in lines[heading + 1 :] for v in line.split()])
    except ValueError as error:
        raise InputError(f'{path}: a value below the heading is no number ({error})') from error
    count = re.search(r'\bNPTS\s*=\s*(\d+)', text[:2000], re.IGNORECASE)
    if count is not None and int(count.group(1)) != len(values):
        raise InputError(f'{path}: NPTS is {count.group(1)}, but {len(values)} values follow')
    return GroundMotion(factor * values, period, path.name)


def _of_heading(path: Path, lines: list[str]) -> float | None:
    """Return the factor to m/s^2 of the unit in lines without columns; None where there is none.

    Raises:
        InputError: another quantity, or a unit that is none of acceleration, or two.
    """
    text = '\n'.join(lines)
    # `VELOCITY TIME SERIES`, but not the velocities of filters and sites: `VS30 VELOCITY`.
    told = re.search(rf'({_OTHER.pattern})\s+(?:time\s+)?(?:series|hist)', text, re.IGNORECASE)
    if told is not None:
        raise InputError(f'{path}: holds {told[1].lower()}, and a ground acceleration is needed')
    said = [unit for line in _SAID.findall(text) if (unit := _listed(line)[1])]
    told_in = [unit.rstrip('.:') for unit in _IN_PROSE.findall(text)]
    said += [unit for unit in told_in if _plain(unit) in _UNITS or _like_a_unit(unit)]
    # Brackets hold remarks as well as units, and `G` may be a station.
    inside = [re.sub(r'^in\s+', '', unit) for unit in _BRACKETS.findall(text)]
    said += [unit for unit in inside if _plain(unit) in _UNITS]
    said += [unit for unit in _LAST.findall(text) if _plain(unit) in _UNITS and unit != 'G']
    factors = {unit: _factor(path, unit) for unit in said}
    if len(set(factors.values())) > 1:
        raise InputError(
            f'{path}: the heading says {" and ".join(factors)}; keep the one it is in'
        )
    return next(iter(factors.values()), None)


def _factor(path: Path, unit: str) -> float:
    """Return the factor from a unit to m/s^2.

    Raises:
        InputError: it is not understood, or of no acceleration.
    """
    if unit == 'SI':
        return 1.0
    if _plain(unit) not in _UNITS:
        raise InputError(
            f'{path}: {unit.strip()!r} is no unit of acceleration that is understood; {_MEND}'
        )
    return _UNITS[_plain(unit)]


def _units_in(name: str) -> list[str]:
    """Return the units that the name of a column of acceleration has, understood or not."""
    inside = [re.sub(r'^in\s+', '', text) for text in _BRACKETS.findall(name)]
    found = [text for text in inside if _plain(text) in _UNITS or _like_a_unit(text)]
    if found:
        return found
    plain = _BRACKETS.sub(' ', name).strip()
    # `acceleration_g`, `acceleration_m_per_s2_raw`, `acceleration in g`, `acc/g`
    first, *words = [w for w in re.split(r'[_\s,]+', plain) if w] or ['']
    if first == 'a' and [w for w in words if not _DIRECTION.fullmatch(w)] == ['g']:
        return [plain]  # the symbol of ground acceleration, or a unit: nothing tells which
    words = [*filter(None, [first.partition('/')[2]]), *words]
    for length in range(len(words), 0, -1):
        for begin in range(len(words) - length + 1):
            unit = '_'.join(words[begin : begin + length])
            if _plain(unit) in _UNITS:
                return [unit]
    rest = [w for w in words if not _DIRECTION.fullmatch(w)]
    # Among words with blanks between them a letter may be anything.
    shown = rest if '_' in name else [w for w in rest[:-1] if re.search(r'[/^]', w)] + rest[-1:]
    return [w for w in shown if _like_a_unit(w)][-1:]


def _other_quantity(name: str) -> bool:
    """Whether the name of a column is one of velocity, displacement or force."""
    plain = _BRACKETS.sub(' ', name).replace('_', ' ')
    other, own = _OTHER.search(plain), _ACCELERATION.search(plain)
    return other is not None and (own is None or other.start() < own.start())


def _seconds(path: Path, name: str) -> float | None:
    """Return the factor to s that the name of a column of time says; None where it says none.

    Raises:
        InputError: another unit of time, or a unit of something else.
    """
    words = [*_BRACKETS.findall(name), *re.split(r'[_/\s]+', _BRACKETS.sub(' ', name))[1:]]
    for word in words:
        if symbol(word) in _TIMES:
            return _TIMES[symbol(word)]
        if _NOT_SECONDS.fullmatch(word) or _like_a_unit(word):
            raise InputError(
                f'{path}: column {name!r} has a unit of time that is not understood; use s or ms'
            )
    return None


def _pair(line: str) -> tuple[str, str] | None:
    """Return the two entries of a line of names or of units, None where there are not two."""
    for delimiter in (';', '\t', ','):
        if delimiter in line.strip(' \t,;'):
            entries = [e.strip().strip('"\'') for e in line.strip(' \t,;').split(delimiter)]
            return (entries[0], entries[1]) if len(entries) == 2 else None
    match = re.fullmatch(r'\s*(\S+(?:\s*[\[(][^\])]*[\])])?)\s+(\S.*)', line)
    return (match[1], match[2].strip()) if match is not None else None


def _units(path: Path, heading: list[str], warn: Note) -> tuple[float, float]:
    """Return the factors of time to s and of acceleration to m/s^2 that a table's heading says.

    Raises:
        InputError: another quantity, or a unit that is not understood.
    """
    seconds, factors, rest = set[float](), dict[str, float](), list[str]()
    named = False
    for line in heading:
        pair = _pair(line)
        bare = pair[0].strip('[](){} ') if pair is not None else ''
        if pair is not None and bare in _TIMES and _plain(pair[1]) in _UNITS:
            seconds.add(_TIMES[bare])  # a line of units
            factors[pair[1]] = _factor(path, pair[1])
            continue
        timed = pair is not None and _TIME.match(pair[0]) is not None
        parted = re.search(r'\S\s*[;\t,]\s*\S', line) is not None
        if pair is None or not (
            timed
            or (parted and _ACCELERATION.search(pair[1]) and not _ACCELERATION.search(pair[0]))
        ):
            rest.append(line)
            continue
        first, second = pair
        if _other_quantity(second):
            raise InputError(
                f'{path}: column {second!r} is no acceleration; give time and ground acceleration'
            )
        told = _seconds(path, first) if timed else None
        seconds |= set() if told is None else {told}
        named = named or _ACCELERATION.search(second.replace('_', ' ')) is not None
        factors |= {unit: _factor(path, unit) for unit in _units_in(second)}
    spoken = _OTHER.search(' '.join(rest).replace('_', ' '))
    other = _of_heading(path, rest)
    if other is not None:
        factors['the line above'] = other
    if not factors and not named and spoken is not None:
        raise InputError(
            f'{path}: the heading speaks of {spoken[0]}, and no column of acceleration with '
            f'its unit is named; {_MEND}'
        )
    listed = [_listed(line)[0] for line in _SAID.findall('\n'.join(rest))]
    seconds |= {_TIMES[unit] for unit in listed if unit}
    if len(seconds) > 1:
        raise InputError(f'{path}: the heading says two units of time; keep the one that it is in')
    if len(set(factors.values())) > 1:
        raise InputError(
            f'{path}: the heading says two units of acceleration ({" and ".join(factors)}); keep '
            'the one that it is in'
        )
    if not factors:
        warn(
            f'{path}: says no unit of acceleration, so m/s^2 was taken; where it is another one, '
            f'{_MEND}'
        )
    return next(iter(seconds), 1.0), next(iter(factors.values()), 1.0)


def _columns(path: Path, text: str, warn: Note) -> GroundMotion:
    """Return a table's: time and acceleration."""
    rows: list[list[float]] = []
    heading: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        comment = line.lstrip().startswith(('#', '%'))
        if comment and not rows:
            heading.append(line.lstrip('#% \t'))
        if not line.strip() or comment:
            continue
        values = _row(line)
        if not values and rows:
            raise InputError(f'{path}: line {number} is not numbers ({line.strip()!r})')
        if not values:
            heading.append(line)
            continue
        if len(values) != 2:
            raise InputError(
                f'{path}: line {number} has {len(values)} numbers; give time and ground '
                f'acceleration: {_MEND}'
            )
        rows.append(values)
    if len(rows) < 2:
        raise InputError(f'{path}: holds no ground motion: no rows of time and acceleration')
    seconds, factor = _units(path, heading, warn)
    table: Array = np.array(rows)
    steps = np.diff(table[:, 0])
    period = float(np.median(steps))
    if not period > 0.0 or np.abs(steps - period).max() > _UNEVEN * period:
        raise InputError(f'{path}: times do not rise evenly; resample the ground motion first')
    return GroundMotion(factor * table[:, 1], seconds * period, path.name)
