"""How an actuator follows its command, in the numbers of hybrid testing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_glue.api.drawn import evenly
from actuator_glue.api.spread import Spread, spread
from actuator_glue.diagnosis.telling.response import amplitude_of, harmonic, near, phases
from actuator_glue.hybrid.actuator import actuator, table_of
from actuator_glue.hybrid.indicators import TargetMotion
from actuator_glue.hybrid.stability import tracking
from actuator_glue.hygiene.clean import clean, common_initial, initial_state
from actuator_glue.hygiene.impulse_removal import despiked
from actuator_glue.inference.least_squares.data import SETTLE, chunks
from actuator_glue.model.effects import Scale, scale
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.online.job import WindowResult
from actuator_glue.records import Array, Record, source_name, source_names
from actuator_glue.report.worst import MOST

if TYPE_CHECKING:
    from actuator_glue.report import html

FREQUENCIES = (1.0, 5.0, 10.0)  # Hz
_DRAWS = 100  # that are simulated over the record
# Fewer of a long record: a hundred of ten minutes at 10 kHz take a minute.
_FEWEST, _SIMULATED = 32, 100_000_000
_AT_ONCE = 1 << 24  # simulated samples that are held at a time
# Draws for delay and amplitude: 2.5 % of fewer are too few for the end of an interval.
_ANSWERS = 400
_WINDOW_DRAWS = 40  # of a window, which has little time
HEADER = ('number', 'unit', 'measured', 'median', '2.5 %', '97.5 %')
# Name in JSON: text, unit and factor for people.
SHOWN = {
    'bandwidth_hz': ('bandwidth (-3 dB)', 'Hz', 1.0),
    'fei_amplitude': ('FEI amplitude', '-', 1.0),
    'fei_delay_s': ('FEI delay', 'ms', 1e3),
    'J1_s': ('J1, lag of the cross-correlation', 'ms', 1e3),
    'J2': ('J2, rms error', '%', 100.0),
    'J3': ('J3, peak error', '%', 100.0),
    'ti_m2': ('TI at the end', 'mm^2', 1e6),
    'hsem': ('HSEM at the end', '%', 100.0),
}


@dataclass(frozen=True, slots=True)
class RecordTracking:
    """How the actuator follows the command of one record.

    Attributes:
        source: the record, by the shortest name that tells it from the others.
        predicted: each number over the draws.
        measured: the same of the record itself, where it has it.
    """

    source: str
    predicted: dict[str, Spread]
    measured: dict[str, float]

    def rows(self) -> list[tuple[str, ...]]:
        """Return a row of text for each number, under HEADER."""
        out = []
        for name, of in self.predicted.items():
            text, unit, factor = shown(name)
            seen = self.measured.get(name)
            told = '' if seen is None else f'{factor * seen:.4g}'
            numbers = (f'{factor * v:.4g}' for v in (of.median, of.lower, of.upper))
            out.append((text, unit, told, *numbers))
        return out


def tables(tracking: Sequence[RecordTracking]) -> list[html.Block]:
    """Return a table for each of the first records, and how many more there are."""
    from actuator_glue.report import html

    told: list[html.Block] = [
        html.Table(HEADER, of.rows(), f'Tracking of {of.source or "the record"}')
        for of in tracking[:MOST]
    ]
    if (more := len(tracking) - MOST) > 0:
        told.append(html.Note(f'tracking of {more} more records: the JSON has it'))
    return told


def ready(records: Sequence[Record]) -> list[Record]:
    """Return the samples of records that are calibrated with: cleaned, without impulses.

    Raises:
        InputError: as `clean`.
    """
    cleaned, _ = clean(records)
    return despiked(cleaned, [common_initial(cleaned)] * len(cleaned))[0]


def records_tracking(
    draws: Array,
    names: Sequence[str],
    structure: Structure,
    records: Sequence[Record],
    among: Sequence[Record] = (),
) -> tuple[RecordTracking, ...]:
    """Return how the actuator follows the command of each record, for every kind of result alike.

    All numbers of a record are of one set of samples: at the rate it was sampled with, without
    impulses, and without the start in which an unknown initial state decays. Delay and amplitude
    of a nonlinear model are those of sines as large as the tests had them.

    Args:
        draws: shape (m, p), SI units.
        names: parameter of each column; those of a likelihood are passed over.
        structure: the model.
        records: the tests, as `ready` returns them.
        among: tests that their names tell them from, these among them; none for these.
    """
    out = []
    called = source_names(r.source for r in among or records)
    sizes = scale(records, draws[:, :4].mean(axis=0))
    for record in records:
        initial = initial_state(record)
        settle = 0 if initial == 'rest' else round(SETTLE / record.period)
        settle = min(settle, len(record) // 2)
        of = record_tracking(draws, names, structure, record, initial, settle)
        k = record.known_stiffness()
        sines = _sines(draws, names, structure, sizes, k)
        out.append(replace(of, source=called[record.source], predicted=sines | of.predicted))
    return tuple(out)


def record_tracking(
    draws: Array,
    names: Sequence[str],
    structure: Structure,
    record: Record,
    initial: Initial,
    settle: int = 0,
    frequencies: Sequence[float] = FREQUENCIES,
    origin: float = 0.0,
) -> RecordTracking:
    """Return the tracking numbers of draws over a record, and the record's own.

    Delay, amplitude and bandwidth are those of a linear model; the others come from simulating
    draws with all their effects.

    Args:
        draws: shape (m, p), SI units.
        names: parameter of each column; those of a likelihood are passed over.
        structure: the model.
        record: the test.
        initial: state at its first sample.
        settle: samples of its start that are not counted while the initial state decays.
        frequencies: where delay and amplitude are told [Hz].
        origin: time of its first sample since the test began [s].
    """
    predicted: dict[str, Any] = {}
    if structure.linear:
        many = _some(draws, names, structure, _ANSWERS)
        stiffness = np.full(len(many), record.known_stiffness())
        linear = actuator(many, structure.names, structure.entries, stiffness)
        found = tracking(linear, frequencies)
        for i, f in enumerate(frequencies):
            predicted[f'delay_at_{f:g}_hz_s'] = spread(found.delay[:, i])
            predicted[f'amplitude_at_{f:g}_hz'] = spread(found.amplitude[:, i])
        predicted['bandwidth_hz'] = spread(found.bandwidth)
    few = max(_FEWEST, _SIMULATED // len(record))
    some = _some(draws, names, structure, min(_DRAWS, few))
    counted = record.slice(settle, len(record))
    drawn: list[dict[str, float]] = []
    if np.ptp(counted.command) > 0.0:
        target = TargetMotion(counted.command, record.period)
        # Even as many as a kernel takes at a time are gigabytes of ten minutes at 10 kHz.
        for part in chunks(len(some), len(record), _AT_ONCE, least=1):
            moved = structure.simulate(some[part], record, initial=initial, origin=origin)
            kept = (x[settle:] for x in moved)
            drawn += [_numbers(counted, target, x) for x in kept if np.isfinite(x).all()]
    measured = _numbers(counted, target, counted.measured) if drawn else {}
    if drawn:
        predicted |= {n: spread(np.array([d[n] for d in drawn])) for n in drawn[0]}
    return RecordTracking(source_name(record.source), predicted, measured)


def _some(draws: Array, names: Sequence[str], structure: Structure, most: int) -> Array:
    """Return some of the draws, without parameters of the likelihood."""
    return table_of(evenly(draws, most), names, structure)


def _sines(
    draws: Array, names: Sequence[str], structure: Structure, sizes: Scale, stiffness: float
) -> dict[str, Spread]:
    """Return delay and amplitude of a nonlinear model, of sines as large as the tests'.

    A diagnosis uses sines of the same size.
    """
    if structure.linear:
        return {}
    table = _some(draws, names, structure, _ANSWERS)
    out = {}
    whole = phases(structure, np.median(table, axis=0), sizes, FREQUENCIES, stiffness)
    for hertz, turned in zip(FREQUENCIES, whole, strict=True):
        size = amplitude_of(sizes, hertz)
        answer = harmonic(structure, table, size, hertz, stiffness)
        answer = answer[np.isfinite(answer)]
        if len(answer) and np.isfinite(turned):
            lag = -near(np.angle(answer), turned)
            out[f'delay_at_{hertz:g}_hz_s'] = spread(lag / (2.0 * np.pi * hertz))
            out[f'amplitude_at_{hertz:g}_hz'] = spread(np.abs(answer))
    return out


def window_tracking(
    result: WindowResult, frequencies: Sequence[float] = FREQUENCIES
) -> RecordTracking | None:
    """Return how the actuator followed the command of a window; None without a posterior."""
    if result.frozen is None or result.failure:
        return None
    record, settings = result.window.record, result.settings
    draws = result.frozen.draws
    return record_tracking(
        draws[:: max(1, len(draws) // _WINDOW_DRAWS)],
        result.model.names,
        Structure(result.model.effects),
        record,
        'measured',
        round(settings.settle / record.period),
        frequencies,
        record.first_index * record.period,
    )


def _numbers(record: Record, target: TargetMotion, moved: Array) -> dict[str, float]:
    index, j = target.frequency_evaluation(moved), target.criteria(moved)
    out = {
        'fei_amplitude': index.amplitude,
        'fei_delay_s': index.delay,
        'J1_s': j.j1,
        'J2': j.j2,
        'J3': j.j3,
        'ti_m2': target.tracking_indicator(moved),
    }
    if record.known_stiffness() > 0.0:
        out['hsem'] = target.energy_error(moved)
    return out


def shown(name: str) -> tuple[str, str, float]:
    """Return text, unit and factor under which people see a number."""
    if name in SHOWN:
        return SHOWN[name]
    what, _, hz, *_ = name.split('_')
    return f'{what} at {hz} Hz', *(('ms', 1e3) if what == 'delay' else ('-', 1.0))
