"""What the page asks for, and what it is sent: one frame of curves, state and trends.

A frame is four bytes with the length of its JSON, the JSON, blanks up to a multiple of four
bytes, then single-precision numbers, little endian: times and rows of the curves, row after row,
and where there are any new ones times and columns of the trends, column after column.
"""

from __future__ import annotations

import json
import math
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.motion import METRES, spoken
from actuator_glue.report.quantity import said_in, word
from actuator_glue.view.history import ROWS, History
from actuator_glue.view.intake import Intake
from actuator_glue.view.trends import TrendColumn

_POINTS = 4000  # at most, whatever the page asks for
_TRENDS = 600  # rows of trends
_ENTRIES = 60  # of the log
_UNITS = ('mm', 'um', 'kN')  # in which curves are drawn
_PAUSE = 0.5  # s, from one sending of trends to the next while a page follows


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


class Frames:
    """Frames of one page, which keeps trends and log that it was sent until there are new ones.

    Attributes:
        owing: there are new ones, which the last frame did not bring.
    """

    def __init__(self, intake: Intake) -> None:
        self.owing = False
        self._intake = intake
        self._sent: tuple[int, ...] | None = None
        self._due = -math.inf

    def next(self, wanted: Wanted, now: float) -> bytes:
        """Return what the page is to show; `now` is a monotonic time [s]."""
        intake = self._intake
        numbers: list[NDArray[np.floating[Any]]] = []
        with intake.lock:
            history = intake.history
            period = history.period or 1.0
            newest = history.known_to
            # Never after what is asked for: the page holds that for the future.
            asked = newest if wanted.stop is None else math.floor(wanted.stop / period + 1e-6)
            stop = min(asked, newest)
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
            }
            state = _state(history, stop)
            motion = state.get('setup', {}).get('motion', METRES)
            content['units'] = {unit: spoken(unit, motion) for unit in _UNITS}
            content['state'] = _said(state, motion)
            key = _key(history, stop)
            # Twenty windows a second would have it draw the whole test anew twenty times.
            self.owing = key != self._sent and wanted.stop is None and now < self._due
            if key != self._sent and not self.owing:
                self._sent, self._due = key, now + _PAUSE
                trends, numbers = _trends(history, stop)
                log = history.log.told(stop, history.period, _ENTRIES)
                content |= {'trends': _said(trends, motion), 'log': _said(log, motion)}
        # Single precision counts from the start of what is shown: whole microseconds stay.
        rows = np.vstack([curves.times - start * period, curves.rows])
        text = json.dumps(content, allow_nan=False).encode()
        text += b' ' * (-len(text) % 4)
        packed = [np.asarray(part, '<f4').tobytes() for part in (rows, *numbers)]
        return b''.join([struct.pack('<I', len(text)), text, *packed])


def _key(history: History, place: int) -> tuple[int, ...]:
    """Return what trends and log depend on at a place."""
    trends, log = history.trends, history.log
    known, lasting = log.counted(place, history.period)
    return trends.version, trends.known(place), log.version, known, lasting


def _state(history: History, place: int) -> dict[str, Any]:
    """Return what was said last, and since when each explanation has been carried, and leads."""
    state = history.state(place)
    for one in state.get('posterior', {}).get('structures', ()):
        column = TrendColumn('weight', one['name'])
        for name, least in (('since', 0.0), ('leads', 0.5)):
            since = history.trends.since(place, column, least)
            one[name] = None if since is None else since * history.period
    for one in _parameters(state):
        one['word'] = word(one['name'])
    return state


def _said(told: Any, motion: str) -> Any:
    """Return what JSON can hold with all sizes in its texts in the units of a motion."""
    if motion == METRES:
        return told
    if isinstance(told, dict):
        return {key: _said(value, motion) for key, value in told.items()}
    if isinstance(told, list):
        return [_said(value, motion) for value in told]
    return spoken(told, motion) if isinstance(told, str) else told


def _parameters(state: dict[str, Any]) -> list[dict[str, Any]]:
    """Return all parameters that a state tells."""
    posterior = state.get('posterior', {})
    effects = state.get('diagnosis', {}).get('effects', ())
    found = list(posterior.get('parameters', ()))
    for one in posterior.get('structures', ()):
        found += one['parameters']
    for one in effects:
        found += [*one['sizes'], *(size for rival in one['tied'] for size in rival['sizes'])]
    return found


def _trends(
    history: History, place: int
) -> tuple[dict[str, Any], list[NDArray[np.floating[Any]]]]:
    """Return head and numbers of the trends that were known at a place, in people's units.

    The numbers are times, the weight of each structure, and mean, standard deviation and whether
    it is little more than the prior of each parameter.
    """
    places, columns = history.trends.before(place, _TRENDS)
    told = {c: values for c, values in columns.items() if not np.isnan(values).all()}
    weights = [column for column in told if column.kind == 'weight']
    numbers = [places * history.period, *(columns[column] for column in weights)]
    parameters = []
    for column, mean in told.items():
        if column.kind == 'mean':
            factor, unit = said_in(column.unit, np.nanmedian(mean))
            parameters.append({'name': column.name, 'word': word(column.name), 'unit': unit})
            sd, prior = (columns[column._replace(kind=kind)] for kind in ('sd', 'prior'))
            numbers += [factor * mean.astype(np.float64), factor * sd.astype(np.float64), prior]
    names = [column.name for column in weights]
    return {'count': len(places), 'weights': names, 'parameters': parameters}, numbers
