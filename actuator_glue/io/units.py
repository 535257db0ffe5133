"""Units of laboratory files: the unit is part of a column's name."""

from __future__ import annotations

import re

from actuator_glue.errors import InputError
from actuator_glue.motion import METRES, MOTIONS, TORQUES
from actuator_glue.si import FORCE, LENGTH

_TIME = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9, 'µs': 1e-6, 'μs': 1e-6}
_TIME |= dict.fromkeys(('sec', 'Sec', 'SEC', 'second', 'seconds', 'Seconds'), 1.0)
_TIME |= dict.fromkeys(('msec', 'mSec', 'milliseconds'), 1e-3)
# Within other names these are words (`Load min`) and letters.
_LONG = {'min': 60.0, 'h': 3600.0, 'hr': 3600.0}

# What a column can be, and factors to SI by unit.
ROLES: dict[str, dict[str, float]] = {
    'time': _TIME | _LONG,
    'command': LENGTH,
    'measured': LENGTH,
    'force': FORCE | {'lb': FORCE['lbf']},
}
# A float32 has no whole number between this one and the next but one.
FLOAT32_COUNTS = 1 << 24
EXAMPLE = 'time_s,command_mm,measured_mm,force_N'
ANGLES = frozenset(unit for unit, (motion, _) in MOTIONS.items() if motion == 'deg')
# Units of other quantities, so that they are recognised as units.
_RAW = frozenset(('V', 'mV', 'volt', 'volts', 'mA', '%', 'count', 'counts', 'cnt', 'inc'))
_OTHERS = frozenset(('bar', 'mbar', 'Pa', 'kPa', 'MPa', 'psi', 'Nm', 'kNm', 'l/min', '°C', 'degC'))
_OTHERS |= {'m/s', 'mm/s', 'deg/s', 'rad/s', 'rpm', 'g', 'm/s2', 'm/s^2', 'm/s²', 'mm/s2', 'Hz'}
# Units that no scale converts to a length.
OF_NO_LENGTH = _OTHERS.union(ROLES['force'], _TIME)
_QUANTITY = {
    'time': 'time',
    'command': 'displacement',
    'measured': 'displacement',
    'force': 'force',
}

# `command_mm`, `Command [mm]`, `command/mm`, `Command in mm`
_NAME = re.compile(
    r'(?P<role>time|command|measured|force)(?:(?<=time)stamp)?'
    r'(?:[\s_/,;:]*(?:in\s+)?[\[(]?\s*(?P<unit>[^\]\)\s]*)\s*[\])]?)?',
    re.IGNORECASE,
)
_BRACKETS = re.compile(r'[\[({<]\s*([^\[\](){}<>]*?)\s*[\])}>]')
_WHOLE = re.compile(r'^[\[(]+\s*([^\[\]()]*?)\s*[\])]+$')  # all in brackets
_OF_MATRIX = re.compile(r'\((?::,\d+|\d+,:)\)\s*$')  # which column of a matrix, as MATLAB says it
_MOVING = ('command', 'measured')
# What else than its own quantity a file may have for a role, and factors to what stands for it.
_OTHER = {role: {u: f for u, (_, f) in MOTIONS.items()} for role in _MOVING} | {'force': TORQUES}
_BETWEEN = re.compile(r'[\s_,;:\[\](){}<>]+')
_KNOWN = ANGLES.union(_RAW, _OTHERS, *ROLES.values()) - set(_LONG)
_LOWER = {unit.lower() for unit in _KNOWN}
# What each unit is of, and its size there; of others than these only the spelling tells.
_SIZES = {unit: (unit, 1.0) for unit in _KNOWN} | MOTIONS
_SIZES |= {u: (what, f) for what in ('time', 'measured', 'force') for u, f in ROLES[what].items()}
_SIZES |= {unit: ('torque', f) for unit, f in TORQUES.items()}
# Units by their symbols as words, in any capitals and in the plural too; some are misspelt often.
_NAMED = {
    'm': 'meter metre',
    'mm': 'millimeter millimetre milimeter millimètre milímetro millimetro',
    'cm': 'centimeter centimetre',
    'um': 'micrometer micrometre micron',
    'in': 'inch inche zoll',
    'N': 'newton',
    'kN': 'kilonewton',
    'MN': 'meganewton',
    's': 'second sekunde sekunden',
    'ms': 'millisecond millisekunde millisekunden',
    'us': 'microsecond',
    'ns': 'nanosecond',
    'min': 'minute minuten',
    'h': 'hour stunde stunden',
    'deg': 'degree grad',
    'rad': 'radian',
    'mrad': 'milliradian',
    'rev': 'revolution',
    'V': 'volt',
    'mV': 'millivolt',
    'mA': 'milliampere milliamp',
    '%': 'percent prozent',
    'counts': 'count',
    'kip': 'kip',
    'lbf': 'lbf',
    'lb': 'lb',
    'Nm': 'newtonmeter newtonmetre',
}
_WORDS = {word: unit for unit, words in _NAMED.items() for word in words.split()}
# Units that no scale is known for here, in small letters and without the `s` of the plural.
_ELSEWHERE = frozenset(
    ('foot', 'feet', 'ft', 'yard', 'mil', 'thou', 'km', 'kilometer', 'kilometre', 'nanometer')
)
_ELSEWHERE |= {'nanometre', 'pound', 'kgf', 'dan', 'tonf', 'kg', 'kilogram', 'gram'}
_ELSEWHERE |= {'min', 'minute', 'hour', 'day', 'ampere', 'amp', 'ohm', 'hertz', 'khz', 'pascal'}
_ELSEWHERE |= {'kelvin', 'celsius', 'fahrenheit', 'microstrain', 'ustrain', 'strain', 'gal'}
# Units that are words of other meanings too, where more words stand beside them.
_EVERYDAY = frozenset(('in', 'g', 'bar', 'inc', 'rev', 'turn', 'turns', 'second', 'count', 'day'))
_EVERYDAY |= {'min', 'amp', 'mil', 'strain', 'foot', 'gal'}
# What stands in the place of a unit and is none.
_NONE = frozenset(
    ('', '1', '?', 'none', 'n/a', 'na', 'nan', 'null', 'nil', 'unknown', 'undefined')
)
_NONE |= {'unitless', 'dimensionless', 'no unit', 'not set', 'a.u.', 'arb', 'user'}
_PLACE = re.compile(r'[\d:,\s]*')  # in brackets: which column of a matrix


def factor(role: str, unit: str | None, where: str) -> float:
    """Return the factor from a unit to SI for a role.

    Raises:
        InputError: no unit, or one that is not understood.
    """
    known = ROLES[role]
    if not unit:
        examples = [u for u in ('m', 'mm', 'N', 'kN', 's') if u in known]
        raise InputError(
            f'{where} has no unit; put it into the name, e.g. '
            f'{" or ".join(f"{role}_{u}" for u in examples)}'
        )
    if unit not in known:
        listed = ', '.join(u for u in known if u.isascii())
        if unit in ANGLES:
            raise InputError(
                f'{where} is an angle ({unit}), and a length is needed: where a lever turns a '
                f'stroke into it, give mm per {unit} as `scale`, with `unit: mm`, in a channel map'
            )
        what = 'which is not understood'
        if unit in _KNOWN:
            what = f'which is none of {_QUANTITY[role]}'
        if unit in OF_NO_LENGTH and role == 'command':
            raise InputError(
                f'{where} has unit {unit!r}, {what}; a displacement command is needed: record the '
                'set point of the position loop'
            )
        raise InputError(
            f'{where} has unit {unit!r}, {what}; use one of {listed} (upper and lower case '
            'matter), or give the factor to one as `scale` in a channel map'
        )
    return known[unit]


def of_file(role: str, unit: str | None, where: str) -> float:
    """Return the factor from a unit of a file to SI, or to the unit used for it in a record.

    Raises:
        InputError: as `factor`; units of another motion or of a torque are accepted.
    """
    other = _OTHER.get(role, {})
    return other[unit] if unit in other else factor(role, unit, where)


def common_motion(units: dict[str, str], where: str) -> str:
    """Return the motion of units by role: metres, or another that command and measured share.

    Raises:
        InputError: two that differ, or a torque where nothing turns.
    """
    found = {r: MOTIONS.get(units[r], (METRES, 1.0))[0] for r in _MOVING}
    first = found['command']
    if len(set(found.values())) > 1:
        role = next(r for r, motion in found.items() if motion != METRES)
        other = 'measured' if role == 'command' else 'command'
        raise InputError(
            f'{where}: {role} has unit {units[role]!r}, which is none of displacement, and '
            f'{other} is in {units[other]}: give {units[other]} per {units[role]} as `scale` in a '
            'channel map'
        )
    if units.get('force') in TORQUES and first != MOTIONS['deg'][0]:
        raise InputError(
            f'{where}: force is a torque ({units["force"]}), and the motion is no angle; give N '
            f'per {units["force"]} as `scale` in a channel map'
        )
    return first


def recognise(name: str) -> tuple[str, str] | None:
    """Return role and unit of a column name such as `command_mm` or `Force [kN]`.

    The unit is empty where the name has none; None where the name is no role. Of several words
    in brackets (`Force [Kilo Newton]`) it is one where they are understood.
    """
    plain = _OF_MATRIX.sub('', name).strip()
    match = _NAME.fullmatch(plain)
    if match is not None:
        return match['role'].lower(), match['unit'] or ''
    words = re.search(r'[\[(]\s*([^\[\]()]+ [^\[\]()]+?)\s*[\])]$', plain)
    if words is not None and is_unit(words[1]):
        match = _NAME.fullmatch(f'{plain[: words.start()]}[{symbol(words[1])}]')
    return (match['role'].lower(), match['unit'] or '') if match is not None else None


def bare(name: str) -> str:
    """Return the role that a column's name gives, without the unit; the name if it gives none."""
    recognised = recognise(name)
    return recognised[0] if recognised else name


def written_unit(name: str) -> str:
    """Return the unit that is written in a column's name, whatever it is of; empty without one.

    In brackets, behind `_`, `/`, a comma or a blank: `Sollweg [mm]`, `cmd_mm_filtered`, `F / kN`.
    """
    role, unit = recognise(name) or ('', '')
    if unit in ROLES.get(role, ()):
        return symbol(unit)
    inside = [text for text in _BRACKETS.findall(name) if not _PLACE.fullmatch(text)]
    for text in inside:
        if text in _KNOWN:
            return str(text)
    first, *words = [w for w in _BETWEEN.split(name) if w] or ['']
    words = words or [first.partition('/')[2]]
    words = [w if w in _KNOWN else w.partition('/')[2] or w for w in words]
    # Within a name `in` and one letter may be anything.
    units = [w for w in words[:-1] if w in _KNOWN and len(w) > 1 and w != 'in']
    # `Load min` is the least one, `time_min` in minutes.
    other = () if recognise(name) else _EVERYDAY
    units += [
        w for w in words[-1:] if w in _KNOWN or (_elsewhere(w) and w.casefold() not in other)
    ]
    capitals = [w for w in words if w.isupper() and len(w) > 1 and w.lower() in _LOWER]
    found = (units or capitals or [str(text) for text in inside] or [''])[-1]
    return symbol(found) if is_unit(found) else found


def symbol(unit: str) -> str:
    """Return the symbol of a unit that may be a word: `Inches`, `meters`, `seconds since 1970`.

    A symbol stays as it is, in its capitals, and so does what is not understood; what is no unit
    (a dash, `none`) is empty.
    """
    bare = unit.strip(' \t[]()').strip()
    if bare in _KNOWN:
        return bare
    plain = bare.casefold()
    if plain in _NONE or not plain.strip('-\u2013\u2014_.* '):
        return ''
    if bare.rstrip('.') in _KNOWN:
        return bare.rstrip('.')
    plain = re.sub(r'\s+since\b.*|[\s-]', '', re.sub(r'(?<=[a-z])\(s\)?$', 's', plain).rstrip('.'))
    return _WORDS.get(plain.removesuffix('s'), _WORDS.get(plain, bare))


def is_unit(text: str) -> bool:
    """Return whether a text is a unit that is known here, of whatever quantity."""
    return symbol(text) in _KNOWN


def contradict(named: str, stated: str) -> bool:
    """Return whether the unit in a column's name and what the file gives as its unit differ.

    They do where that is another unit, or holds one and not the named one: `Volts`, `Length (m)`.
    Spellings of one unit contradict nothing, nor do words that are no unit, nor anything beside a
    name without a unit that is known here. Where only the capitals differ they do not, unless
    these are of `M` and `m`, a factor of a billion.
    """
    named, whole = symbol(named), symbol(stated)
    known = _SIZES.get(named)
    if known is None or not whole:
        return False
    if whole in _SIZES:
        return known != _SIZES[whole]
    if named.casefold() == whole.casefold():
        return not whole.isupper() and {named[0], whole[0]} == {'m', 'M'}
    if whole.casefold() in _LOWER or _elsewhere(whole):
        return True
    found = _units_within(stated)
    return bool(found) and not any(
        _SIZES.get(unit) == known or unit.casefold() == named.casefold() for unit in found
    )


def _elsewhere(word: str) -> bool:
    """Whether a word is a unit that no scale is known for here: by its name, or made of others."""
    small = word.casefold()
    if small in _ELSEWHERE or small.removesuffix('s') in _ELSEWHERE:
        return True
    first, *behind = re.split(r'[/^*·]', word)
    return bool(behind) and small not in _NONE and is_unit(first)


def _units_within(text: str) -> list[str]:
    """Return the units among the words of a text: `mm (abs)`, `Length (mm)`, `Weg/mm`."""
    inside = [entry.strip() for entry in _BRACKETS.findall(text)]
    found = [symbol(entry) for entry in inside if is_unit(entry) or _elsewhere(entry)]
    plain = re.sub(r'\s*/\s*', '/', re.sub(r'(?<=\w)\(s\)', 's', text))
    for word in re.split(r'[\s_,;]+', _BRACKETS.sub(' ', plain)):
        tail = word.partition('/')[2]
        word = tail if tail and not is_unit(word.partition('/')[0]) else word.strip(':;.')
        if word.casefold() not in (*_NONE, *_EVERYDAY) and (is_unit(word) or _elsewhere(word)):
            found.append(symbol(word))
        elif word.isupper() and len(word) > 1 and word.casefold() in _KNOWN:
            found.append(word)
    return found


def units_line(entries: list[str]) -> list[str]:
    """Return the units that a line below the names holds; nothing where it is no such line.

    Each entry is a unit, in brackets or not, empty, or a dash; at least one unit is known here.
    """
    known = ANGLES.union(*ROLES.values()) - set(_LONG)
    units = [_WHOLE.sub(r'\1', entry.strip()) for entry in entries]
    short = all(len(u) <= 12 and not _is_number(u) for u in units)
    return units if short and any(symbol(u) in known for u in units) else []


def kinds_line(entries: list[str]) -> bool:
    """Whether a line below the units says of what kind the samples are: `Smp`, `SR=100 Hz`.

    Its words repeat, as names do not, and none is or begins with a number.
    """
    words = [entry for entry in entries if entry]
    numbers = any(_is_number(word) or word[0].isdigit() for word in words)
    return len(set(words)) < len(words) and not numbers


def _is_number(text: str) -> bool:
    try:
        float(text.replace(',', '.'))
    except ValueError:
        return False
    return True


def choose(
    names: list[str], units: list[str], where: str, needed: tuple[str, ...]
) -> tuple[dict[str, tuple[int, str]], str]:
    """Return position and unit of every column that has a role, and their motion.

    Args:
        names: column names, unit included.
        units: what the file gives as the unit of each column; holds where the name has none, and
            must not contradict it.
        where: file, for messages.
        needed: roles that must be there.

    Raises:
        InputError: a unit is missing, unknown or said twice differently, a role is there twice
            or a needed one not.
    """
    called: dict[str, list[tuple[int, str]]] = {}
    for position, name in enumerate(names):
        role, unit = recognise(name) or ('', '')
        if role:
            called.setdefault(role, []).append((position, unit))
    found: dict[str, tuple[int, str]] = {}
    for role, columns in called.items():
        # Beside `command_mm` another quantity is none: `command_velocity_mm_s`.
        known = {*ROLES[role], *_OTHER.get(role, ())}
        able = [(at, unit) for at, unit in columns if not unit or symbol(unit) in known]
        (position, unit), *others = able or columns
        name, stated = names[position].strip(), units[position]
        if others:
            raise InputError(
                f'{where}: two columns are called {role}, {name!r} and '
                f'{names[others[0][0]].strip()!r}; keep one, or name the one that is meant in a '
                'channel map'
            )
        found[role] = position, symbol(unit or stated)
        place = f'{where}: column {name!r}'
        if contradict(unit, stated):
            raise InputError(
                f'{place} has unit {unit!r} in its name, and the file gives {stated!r} as its '
                'unit; mend the one that is wrong, or say the unit in a channel map'
            )
        of_file(role, found[role][1], place)
    for role in needed:
        if role not in found:
            # Only command or measured is here: the other may be in a file of its own.
            half = len({'command', 'measured'} & set(found)) == 1 and role in _MOVING
            join = ', or join it with the file that has it (`convert --join`)' if half else ''
            raise InputError(
                f'{where}: no column for {role}; the columns are '
                f'{", ".join(n.strip() for n in names)}. Name them as in {EXAMPLE}, or describe '
                f'the file with --channels MAP.yaml, which `actuator-glue map` proposes{join}'
            )
    written = {role: unit for role, (_, unit) in found.items()}
    if not {'command', 'measured'} <= set(found):  # a part of a test
        return found, MOTIONS.get(''.join(written.get(r, '') for r in _MOVING), (METRES, 1.0))[0]
    return found, common_motion(written, where)
