"""Check records before any look at them, and set the held-out part aside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from actuator_glue.errors import InputError
from actuator_glue.model.exact import Initial
from actuator_glue.records import Record
from actuator_glue.residual.data import Data, Mask

_SHORTEST = 5.0  # s
_SMALLEST = 5e-6  # m of command, from end to end: below it is no test of an actuator
_LEAD = 5e-3  # s by which a measured displacement may lead (a compensated command)
_REACH = 0.5  # s of lag that is looked at
_FASTEST = 10.0  # m/s: no servo-hydraulic actuator follows
_REST = 1.5  # s of constant command that define the zero of both channels
_SETTLE = 1.0  # s in which an unknown initial state is forgotten
_RATE = 300.0  # Hz: counted samples need not be denser, no effect acts above 100 Hz
_FOLD = 4  # every fourth block is held out where no record is
_FOLD_LENGTH = 3.0  # s


@dataclass(frozen=True)
class Prepared:
    """Data to fit and data set aside.

    Attributes:
        fit: what every decision is made on.
        held: what is looked at once, after all decisions.
        notes: what was done to the records, for people.
    """

    fit: Data
    held: Data
    notes: tuple[str, ...]


def _where(record: Record, number: int) -> str:
    return record.source or f'record {number}'


def check(record: Record, number: int) -> None:
    """Refuse a record that cannot be diagnosed.

    Raises:
        InputError: stiffness not known, too short, nothing moves, units that do not match, or
            channels that are swapped or of opposite sign.
    """
    where = _where(record, number)
    record.known_stiffness()
    if record.duration < _SHORTEST or len(record) < 500:
        raise InputError(
            f'{where}: {record.duration:.3g} s ({len(record)} samples) are too short for a '
            f'diagnosis; give at least {_SHORTEST:g} s and 500 samples'
        )
    replace(record, source=where).check_channels()
    reach = float(np.ptp(record.command))
    speed = float(np.quantile(np.abs(np.diff(record.command)), 0.99)) / record.period
    if reach < _SMALLEST or speed > _FASTEST:
        raise InputError(
            f'{where}: the command moves {reach:.3g} m in all, at up to {speed:.3g} m/s; check '
            'the units of its channel and of time (metres and seconds are expected)'
        )
    _follows(record, where)


def _follows(record: Record, where: str) -> None:
    """Refuse channels that are swapped or of opposite sign: an actuator follows its command.

    Raises:
        InputError: the measured displacement leads the command, or moves against it.
    """
    u, y = (c - c.mean() for c in (record.command, record.measured))
    cross = signal.correlate(y, u, method='fft') / np.sqrt(float(u @ u) * float(y @ y))
    reach = min(len(u) // 4, round(_REACH / record.period))
    near = cross[len(u) - 1 - reach : len(u) + reach]
    lags = np.arange(-reach, reach + 1) * record.period
    at = int(np.argmax(np.abs(near)))
    lead = -lags[at]
    # A periodic command has other peaks as high: then nothing can be said.
    peaks = signal.find_peaks(np.abs(near), height=0.9 * abs(near[at]))[0]
    if abs(near[at]) < 0.5 or len(peaks) > 1:
        return
    if near[at] < 0.0:
        raise InputError(
            f'{where}: the measured displacement moves against the command (correlation '
            f'{near[at]:.2f}); change the sign of one channel'
        )
    if lead > max(_LEAD, 2.0 * record.period):
        raise InputError(
            f'{where}: the measured displacement leads the command by {1e3 * lead:.0f} ms; '
            'check whether the two channels are swapped, or their clocks apart'
        )


def rest_samples(record: Record) -> int:
    """Samples at the beginning in which the command does not move."""
    off = np.abs(record.command - record.command[0])
    moving = off > 2e-3 * float(off.max())
    return int(np.argmax(moving))


def zeroed(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Remove each channel's rest offset where every record begins at rest.

    The zero of a transducer is a setting of the day, not a property of the actuator; it is
    removed only where all records show it, so that they stay comparable.
    """
    rests = [rest_samples(r) for r in records]
    if any(rest * r.period < _REST for rest, r in zip(rests, records, strict=True)):
        return list(records), []
    out, notes = [], []
    for i, (rest, record) in enumerate(zip(rests, records, strict=True)):
        command = float(np.median(record.command[:rest]))
        measured = float(np.median(record.measured[:rest]))
        out.append(
            replace(record, command=record.command - command, measured=record.measured - measured)
        )
        notes.append(
            f'{_where(record, i + 1)}: rest offsets removed, command {1e6 * command:.1f} um, '
            f'measured {1e6 * measured:.1f} um'
        )
    return out, notes


def _initial(record: Record) -> Initial:
    """A record that begins near its zero begins at rest; any other has an unknown state."""
    stroke = float(np.abs(record.command - np.median(record.command)).max())
    head = record.command[: max(2, round(0.02 / record.period))]
    return 'rest' if float(np.abs(head).max()) < 0.05 * stroke else 'measured'


def _folds(record: Record) -> Mask:
    """Blocks held out of one record, spread over time and so over a sweep's frequency."""
    length = min(_FOLD_LENGTH, record.duration / 12.0)
    block = np.floor(record.time / length).astype(np.int64)
    return np.asarray(block % _FOLD == _FOLD - 1)


def prepare(records: Sequence[Record], holdout: Sequence[Record]) -> Prepared:
    """Check, zero and split records into a fitting and a held-out part.

    Raises:
        InputError: see `check`; or no record.
    """
    if not records:
        raise InputError('no record to diagnose')
    for i, record in enumerate((*records, *holdout)):
        check(record, i + 1)
    clean, notes = zeroed([*records, *holdout])
    fitted, held = clean[: len(records)], clean[len(records) :]
    initials = tuple(_initial(r) for r in clean)
    masks, strides = [], []
    for record, initial in zip(clean, initials, strict=True):
        stride = max(1, int(record.rate / _RATE + 1e-9))
        mask = np.zeros(len(record), dtype=np.bool_)
        mask[::stride] = True
        if initial == 'measured':
            mask[: round(_SETTLE / record.period)] = False
        masks.append(mask)
        strides.append(stride)
    n = len(records)
    if held:
        return Prepared(
            Data(tuple(fitted), tuple(masks[:n]), initials[:n], tuple(strides[:n])),
            Data(tuple(held), tuple(masks[n:]), initials[n:], tuple(strides[n:])),
            tuple(notes),
        )
    folds = [_folds(r) for r in fitted]
    notes.append('every fourth block of each record held out')
    return Prepared(
        Data(
            tuple(fitted),
            tuple(m & ~f for m, f in zip(masks, folds, strict=True)),
            initials,
            tuple(strides),
        ),
        Data(
            tuple(fitted),
            tuple(m & f for m, f in zip(masks, folds, strict=True)),
            initials,
            tuple(strides),
        ),
        tuple(notes),
    )
