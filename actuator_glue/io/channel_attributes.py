"""What attributes of a channel say: its unit, and gains and offsets, which nobody applies."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from actuator_glue.io.noted_rate import plain

# Under which attribute a channel has its unit, the last as LabVIEW writes it.
UNIT_NAMES = ('unit', 'units', 'Unit', 'Units', 'unit_string')
# Names of what numbers may have to be multiplied by, and of what may have to be added.
_GAIN = re.compile(
    r'(?:(?:cal|calib|calibration|scal(?:e|ing)|conversion|channel)_?)?'
    r'(?:gain|factor|scal(?:e|ing)|slope|multiplier|coefficient)|calibration_constant'
)
_OFFSET = re.compile(r'(?:(?:add|cal|calibration|scal(?:e|ing)|channel)_?)?(?:offset|intercept)')


def unit_of(attributes: Mapping[str, Any]) -> str:
    """Return the unit that attributes of a channel say; empty where they say none."""
    return next((plain_text(attributes[n]) for n in UNIT_NAMES if n in attributes), '')


def plain_text(value: Any) -> str:
    """Return an attribute as text: bytes decoded, a number in full, of an array of one its own.

    Empty where it has no value, as HDF5 may have a text of no letters.
    """
    if getattr(value, 'shape', ()) is None:
        return ''
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.flat[0]
    if isinstance(value, bytes):
        return value.decode('utf-8', 'replace')
    return repr(float(value)) if isinstance(value, np.number) else str(value)


def scaling(attributes: Mapping[str, Any], applied: tuple[str, ...] = ()) -> str:
    """Return the gains and offsets, none of 1 and 0, that attributes of a channel say: `gain = 2`.

    No convention tells whether the numbers have them already, so nobody applies them.

    Args:
        attributes: of the channel, by their names.
        applied: names that the convention of a format defines.
    """
    found = []
    for name in attributes:
        if name in applied:
            continue
        word = plain(name)
        neutral = 1.0 if _GAIN.fullmatch(word) else 0.0 if _OFFSET.fullmatch(word) else None
        if neutral is None or np.size(attributes[name]) != 1:
            continue
        try:
            value = float(np.ravel(attributes[name])[0])
        except (TypeError, ValueError):
            continue
        if np.isfinite(value) and value != neutral:
            found.append(f'{name} = {value:g}')
    return ', '.join(found)
