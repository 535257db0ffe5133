"""The sample rate that a file states beside its columns: `sample rate: 1024 Hz`, `dt = 1 ms`."""

from __future__ import annotations

import re
from collections.abc import Mapping

from actuator_glue.records import FASTEST_RATE, SLOWEST_RATE

# A sample rate as people write it, with its unit in the name or behind the value: Hz without one.
_RATE = re.compile(
    r'(?:sampl(?:e|es|ing)_?(?:rate|freq(?:uency)?)|samples_per_second|abtast(?:rate|frequenz)|f_?s)'
    r'(?:_?[\[(]?(?P<unit>k?hz|1/s|s/s)[\])]?)?'
)
_STEP = re.compile(
    r'(?:sampl(?:e|ing)_?(?:interval|period)|time_?step|delta_?t|dt)'
    r'(?:_?[\[(]?(?P<unit>[munµμ]?s)[\])]?)?'
)
# Three digits behind a comma may be thousands.
_SIZE = re.compile(
    r'(?P<size>\d+(?:\.\d+|,(?:\d\d?|\d{4,}))?(?:e[+-]?\d+)?)\s*'
    r'(?P<unit>k?hz|hertz|sps|s/s|1/s|samples(?:/s| per second)|[munµμ]?s)?'
)
_GROUPED = re.compile(r'\d{1,3}\.\d{3}(?!\d)')
_HERTZ = dict.fromkeys(('', 'hz', 'hertz', 'sps', 's/s', '1/s'), 1.0)
_HERTZ |= {'samples/s': 1.0, 'samples per second': 1.0, 'khz': 1e3}
_SECONDS = {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'µs': 1e-6, 'μs': 1e-6, 'ns': 1e-9}


def noted_rates(notes: Mapping[str, str]) -> dict[float, str]:
    """Return each sample rate [Hz] that a file states, and how it is written there."""
    return {
        rate: f'{name}{"" if name.endswith(":") else " ="} {value}'
        for name, value in notes.items()
        if (rate := rate_of(name.removesuffix(':'), value)) is not None
    }


def take_rate(line: str, notes: dict[str, str]) -> None:
    """Add what a line that is no comment says of the sample rate: `Sample rate,1024,Hz`."""
    name, *behind = re.split(r'[:=,;\t]', line.replace('"', ''), maxsplit=1)
    value = ' '.join(re.split(r'[\s,;]+', ''.join(behind).strip(' \t,;')))
    if rate_of(name, value) is not None:
        add_rate(notes, f'{name.strip()}:', value)


def add_rate(notes: dict[str, str], name: str, value: str) -> None:
    """Add what a file says of its sample rate; said twice, differently, it is no rate."""
    before = notes.get(name, value)
    notes[name] = value if before == value else f'{before} and {value}'


def may_be_thousands(name: str, value: str) -> bool:
    """Return whether a rate beside decimal commas may have a point for thousands: `10.000 Hz`."""
    return is_rate(name.removesuffix(':')) and _GROUPED.match(value) is not None


def is_rate(name: str) -> bool:
    """Return whether a name says that a sample rate, or the time between samples, is given."""
    return any(pattern.fullmatch(plain(name)) for pattern in (_RATE, _STEP))


def rate_of(name: str, value: str) -> float | None:
    """Return the sample rate that a name and its value state [Hz].

    None for another note, a rate that no test here has, and a time between samples without a unit.
    """
    size = _SIZE.fullmatch(value.strip().casefold())
    rate, step = (pattern.fullmatch(plain(name)) for pattern in (_RATE, _STEP))
    said = rate or step
    if size is None or said is None:
        return None
    unit, number = size['unit'] or said['unit'] or '', float(size['size'].replace(',', '.'))
    if unit in _SECONDS and number > 0.0:
        found = 1.0 / (number * _SECONDS[unit])
    elif unit in _HERTZ and rate is not None:
        found = number * _HERTZ[unit]
    else:
        return None
    return found if SLOWEST_RATE <= found <= FASTEST_RATE else None


def plain(name: str) -> str:
    """Return a name in small letters, `_` for blanks and dashes."""
    return re.sub(r'[\s-]+', '_', name.strip()).casefold()
