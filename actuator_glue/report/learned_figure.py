"""Learned terms as curves: what each adds to its signal over the range that was excited."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure

from actuator_glue.diagnosis.learned.sizes import DIMENSIONS, unit_text
from actuator_glue.diagnosis.learned.term import LearnedTerm
from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.model.effects.terms.entry import along
from actuator_glue.model.effects.terms.expression import MEMORY, PLACES, SIGNAL
from actuator_glue.model.effects.terms.filters import FILTERS
from actuator_glue.records import Array
from actuator_glue.report import style

_CYCLES, _POINTS = 20, 200  # of a sine, the last of which is drawn; points a cycle
_DRAWS = 256
# Functions that depend on how fast things move.
_TIMED = {*MEMORY, *FILTERS} - {'play'}
_QUICK = 'veq'  # are largest where the motion passes its middle
_UNITS = {
    'm': (1e3, 'mm', 1e6, 'um'),
    'N': (1e-3, 'kN', 1.0, 'N'),
    'N/s': (1e-3, 'kN/s', 1.0, 'N/s'),
}


def usual_frequency(found: DiagnosisData) -> float:
    """Return the frequency of a sine that is as large and as fast as the commands [Hz]."""
    moving = [t for t in found.traces if np.ptp(t.command) > 0.0]
    speeds = [np.gradient(t.command, t.time).std() / t.command.std() for t in moving]
    return float(np.median(speeds)) / (2.0 * np.pi) if speeds else 1.0


def curve(found: DiagnosisData, term: LearnedTerm) -> tuple[str, Array, Array]:
    """Return what a term adds along a motion over the range that was excited.

    The motion is the last of some cycles of a sine of the usual frequency, so that a term with
    memory no longer depends on its start; a term that changes with time is followed over the
    test, where the signal is largest.

    Returns:
        The symbol that it is drawn over ('t', or the term's signal), its values (n,), and the
        median and the ends of the 95 % interval of what is added, (3, n) [SI].
    """
    signal = SIGNAL[PLACES[term.place]]
    columns = [found.names.index(p) for p in term.parameters]
    draws = found.joint[:: max(1, len(found.joint) // _DRAWS)][:, columns]
    over = 't' if 't' in term.excited else signal
    turn = np.linspace(0.0, 2.0 * np.pi * _CYCLES, _CYCLES * _POINTS + 1)
    motion = {}
    for symbol, (low, high) in term.excited.items():
        wave = np.cos(turn) if symbol in _QUICK else np.sin(turn)
        motion[symbol] = 0.5 * (low + high) + 0.5 * (high - low) * wave
        if over == 't':
            steady = np.full(len(turn), high)
            motion[symbol] = np.linspace(low, high, len(turn)) if symbol == 't' else steady
    motion.setdefault(signal, np.zeros(len(turn)))
    stiffness = max(t.stiffness for t in found.traces)
    cycle = 1.0 / (usual_frequency(found) * _POINTS)
    step = float(motion[over][1] - motion[over][0]) if over == 't' else cycle
    motion.setdefault('t', step * np.arange(len(turn), dtype=np.float64))
    after = along(term.effect, draws, motion, step, stiffness, found.best[:4])
    added = after - motion[signal]
    drawn = slice(None) if over == 't' else slice(-_POINTS - 1, None)
    low, middle, high = np.quantile(added[:, drawn], [0.025, 0.5, 0.975], axis=0)
    return over, motion[over][drawn], np.stack([middle, low, high])


@style.styled
def learned_terms(found: DiagnosisData) -> Figure:
    """Draw every learned term's curve with its 95 % band; one that remembers is a loop."""
    columns = min(len(found.learned), 2)
    figure, panels = style.panels(len(found.learned), columns, 2.6)
    for axes, term in zip(panels, found.learned, strict=True):
        over, at, (middle, low, high) = curve(found, term)
        signal = SIGNAL[PLACES[term.place]]
        scale, unit, fine, fine_unit = _UNITS[unit_text(DIMENSIONS[signal])]
        x = at if over == 't' else scale * at
        for part in _ways(at):
            axes.fill_between(x[part], fine * low[part], fine * high[part], color=style.LIGHT_BAND)
        axes.plot(x, fine * middle, color=style.TOTAL, lw=1.0)
        at_hertz = (
            f', at {usual_frequency(found):.2g} Hz'
            if _TIMED.intersection(re.findall(r'\w+', term.equation))
            else ''
        )
        axes.set_xlabel('time [s]' if over == 't' else f'{signal} [{unit}]{at_hertz}')
        axes.set_ylabel(f'added to {signal} [{fine_unit}]')
        axes.set_title(style.fit(term.name, style.WIDTH / columns - 0.5))
    return figure


def _ways(at: Array) -> list[slice]:
    """Cut a path (n,) where it turns, so that its band is filled in one direction at a time."""
    turns = np.flatnonzero(np.diff(np.sign(np.diff(at)))) + 1
    edges = [0, *turns.tolist(), len(at) - 1]
    return [slice(a, b + 1) for a, b in pairwise(edges)]
