"""What the page asks for, and what it is sent: one frame of curves and state.

A frame is four bytes with the length of its JSON, the JSON, blanks up to a multiple of four
bytes, then times and rows as single-precision numbers, little endian, row after row.
"""

from __future__ import annotations

import json
import math
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.view.history import ROWS
from actuator_glue.view.intake import Intake

_POINTS = 4000  # at most, whatever the page asks for


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a page shows.

    Attributes:
        stop: right end [s]; None for the newest samples.
        span: how much [s].
        points: at most so many.
    """

    stop: float | None = None
    span: float = 10.0
    points: int = 1500


def parse_wanted(text: str) -> Wanted:
    """Return what a page asks for.

    Raises:
        InputError: it is no such request.
    """
    try:
        asked = json.loads(text)
        stop = None if asked['stop'] is None else float(asked['stop'])
        span, points = float(asked['span']), int(asked['points'])
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise InputError(f'no request for a view ({error})') from error
    if not (1e-3 <= span <= 1e6 and points >= 10 and math.isfinite(stop or 0.0)):
        raise InputError('no request for a view: span or points are absurd')
    return Wanted(stop, span, min(points, _POINTS))


def frame(intake: Intake, wanted: Wanted) -> bytes:
    """Return what a page is to show."""
    with intake.lock:
        history = intake.history
        period = history.period or 1.0
        newest = history.known_to
        stop = newest if wanted.stop is None else min(round(wanted.stop / period), newest)
        span = max(round(wanted.span / period), 1)
        # What was said long after the last sample still has samples beside it.
        start = min(stop - span, history.measured_to - max(span // 2, 1))
        curves = history.curves(start, stop, wanted.points)
        content: dict[str, Any] = {
            'title': intake.title,
            'live': intake.live,
            'rows': ['time', *ROWS],
            'count': len(curves.times),
            'start': start * period,
            'stop': stop * period,
            'oldest': history.oldest * period,
            'newest': newest * period,
            'state': history.state(stop),
        }
    # Single precision counts from the start of what is shown: whole microseconds stay.
    rows = np.vstack([curves.times - start * period, curves.rows]).astype('<f4')
    text = json.dumps(content, allow_nan=False).encode()
    text += b' ' * (-len(text) % 4)
    return struct.pack('<I', len(text)) + text + rows.tobytes()
