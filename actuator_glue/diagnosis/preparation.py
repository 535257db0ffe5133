"""Check and zero records before any look at them, and set the held-out part aside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from actuator_glue.diagnosis import decimate, despike, frozen, glitches
from actuator_glue.diagnosis.base_prior import BasePrior
from actuator_glue.diagnosis.checks import check, refuse_repeats, where
from actuator_glue.diagnosis.data import SETTLE, Data, Mask
from actuator_glue.diagnosis.free_run import Model
from actuator_glue.diagnosis.impulses import NONE, Impulses
from actuator_glue.diagnosis.moments import Moment
from actuator_glue.diagnosis.wrong_setup import WrongSetup
from actuator_glue.errors import InputError
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

_SHORTEST = 5.0  # s
_MOVED = 2e-3  # of its largest excursion: a command within it has not begun
_HEAD = 0.5  # s that show where it rests and how noisy its channel is
_SMOOTH = 0.03  # s
_REST = 1.5  # s of constant command that define the zero of both channels
# Share of its range that a channel may be away from zero, or move within a moment, at rest.
_STILL = 0.05
_MOMENT = 0.02  # s
_FOLD = 4  # every fourth block is held out where no record is
_FOLD_LENGTH = 3.0  # s


@dataclass(frozen=True)
class Prepared:
    """Data to fit and data set aside.

    Attributes:
        fit: what every decision is made on.
        held: what is looked at once, after all decisions.
        notes: what else was done to the records, for people.
        folded: the held-out part are stretches of the fitting records.
        impulses: what was taken out of each fitting record (see diagnosis/despike.py).
        held_impulses: and of each other record that is held out.
        setup: what was taken for the records' set-up instead of what was given; None for nothing.
    """

    fit: Data
    held: Data
    notes: tuple[str, ...]
    folded: bool
    impulses: tuple[Impulses, ...]
    held_impulses: tuple[Impulses, ...]
    setup: WrongSetup | None = None

    @property
    def told(self) -> tuple[str, ...]:
        """What was done to the records, impulses first, for people."""
        return (
            *despike.told(self.fit.records, self.impulses),
            *despike.told(self.held.records, self.held_impulses),
            *self.notes,
        )

    def without_impulses(self, model: Model, theta: Array) -> Prepared:
        """Take out what is an impulse beside a model; the same object where nothing else is.

        What passed for one beside another model is restored.
        """
        fit, found = despike.without_impulses(self.fit, model, theta, self.impulses)
        if self.folded:
            held, others = replace(fit, masks=self.held.masks), self.held_impulses
        else:
            held, others = despike.without_impulses(self.held, model, theta, self.held_impulses)
        if fit is self.fit and (self.folded or held is self.held):
            return self
        return replace(self, fit=fit, held=held, impulses=found, held_impulses=others)

    def since(self, moment: Moment) -> Prepared:
        """Leave out what came before a moment; other records held out are taken to be later."""
        fit = moment.split(self.fit)[1]
        held = moment.split(self.held)[1] if self.folded else self.held
        pairs = zip(self.fit.recorded, self.impulses, strict=True)
        kept = tuple(i for r, i in pairs if any(r is k for k in fit.recorded))
        return replace(self, fit=fit, held=held, impulses=kept)


def rest_samples(record: Record) -> int:
    """Samples at the beginning in which the command does not move.

    The command is smoothed over a few hundredths of a second: one that was recorded by a noisy
    channel does not move with every sample.
    """
    head = record.command[: max(2, round(_HEAD / record.period))]
    width = max(1, round(_SMOOTH / record.period))
    centre = float(np.median(head))
    noise = 1.4826 * float(np.median(np.abs(head - centre))) / np.sqrt(width)
    off = np.abs(scipy.ndimage.uniform_filter1d(record.command, width, mode='nearest') - centre)
    moving = off > max(_MOVED * float(off.max()), 6.0 * noise)
    return int(np.argmax(moving)) if noise < _MOVED * float(off.max()) else 0


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
        # Most commands begin at zero: no copy of those.
        still = record.command - command if command else record.command
        out.append(replace(record, command=still, measured=record.measured - measured))
        notes.append(
            f'{where(record, i + 1)}: rest offsets removed, command {1e6 * command:.1f} um, '
            f'measured {1e6 * measured:.1f} um'
        )
    return out, notes


def initial_state(record: Record) -> Initial:
    """Return where a record starts: at rest at zero, or in a state only its samples show.

    The command tells whether it is zero, for the measured displacement has an offset of its own;
    that neither channel moves tells rest from a zero crossing at speed.
    """
    head = slice(0, min(len(record), 1 + max(1, round(_MOMENT / record.period))))
    stroke = float(np.abs(record.command - np.median(record.command)).max())
    if float(np.abs(record.command[head]).max()) > _STILL * stroke:
        return 'measured'
    for channel in (record.command, record.measured):
        if abs(float(channel[head][-1] - channel[0])) > _STILL * float(np.ptp(channel)):
            return 'measured'
    return 'rest'


def clean(
    records: Sequence[Record], holdout: Sequence[Record] = ()
) -> tuple[list[Record], list[str]]:
    """Check records, fill channels that are slower, zero them, take glitches out of commands.

    Returns:
        The records in the order given, held-out ones last, and what was done, for people.

    Raises:
        InputError: a record that cannot be fitted, given twice, or fitted and held out.
    """
    every = [*records, *holdout]
    for i, record in enumerate(every):
        check(record, i + 1)
    refuse_repeats(records, holdout)
    every, notes = _filled(every)
    every, more = zeroed(every)
    every, glitches_told = glitches.mended(every, [initial_state(r) for r in every])
    return every, [*glitches_told, *notes, *more]


def _filled(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """Fill in channels of displacement that are slower than their recorder: no delay is left."""
    out, notes = [], []
    for i, record in enumerate(records):
        every = frozen.every_which(record.measured)
        if every > 1:
            notes.append(
                f'{where(record, i + 1)}: the measured displacement changes in one sample of '
                f'{every} only, its channel gives {record.rate / every:.4g} Hz of '
                f'{record.rate:.4g}; a cubic runs between its changes'
            )
            record = replace(record, measured=frozen.filled(record.measured, every))
        out.append(record)
    return out, notes


def _folds(record: Record) -> Mask:
    """Blocks held out of one record, spread over time and so over a sweep's frequency."""
    length = min(_FOLD_LENGTH, record.duration / 12.0)
    block = np.floor(record.time / length).astype(np.int64)
    return np.asarray(block % _FOLD == _FOLD - 1)


def prepare(
    records: Sequence[Record], holdout: Sequence[Record], prior: BasePrior | None = None
) -> Prepared:
    """Check, zero, decimate and split records into a fitting and a held-out part.

    Both know the prior, if there is one.

    Raises:
        InputError: see `clean`; no record, or one that is too short.
    """
    if not records:
        raise InputError('no record to diagnose')
    for i, record in enumerate((*records, *holdout)):
        if record.duration < _SHORTEST or len(record) < 500:
            raise InputError(
                f'{where(record, i + 1)}: {record.duration:.3g} s ({len(record)} samples) are too '
                f'short for a diagnosis; give at least {_SHORTEST:g} s and 500 samples'
            )
    every, notes = clean(records, holdout)
    initials = tuple(initial_state(r) for r in every)
    recorded, every = tuple(every), []
    for i, record in enumerate(recorded):
        count = decimate.factor(record)
        every.append(decimate.decimated(record, count))
        if count > 1:
            notes.append(
                f'{where(record, i + 1)}: {record.rate:g} Hz are more than what moves in it needs '
                f'(motion up to {decimate.motion_bandwidth(record):.3g} Hz): means over '
                f'{count} samples are fitted, at {every[-1].rate:.4g} Hz; errors and noise are '
                'theirs'
            )
    masks = []
    for record, initial in zip(every, initials, strict=True):
        mask = np.ones(len(record), dtype=np.bool_)
        if initial == 'measured':
            mask[: round(SETTLE / record.period)] = False
        masks.append(mask)
    n, origins = len(records), (0.0,) * len(every)
    if holdout:
        parts = (slice(0, n), slice(n, None))
        fit, held = (
            Data(tuple(every[s]), tuple(masks[s]), initials[s], recorded[s], origins[s], prior)
            for s in parts
        )
        return _mended(
            Prepared(fit, held, tuple(notes), False, (NONE,) * n, (NONE,) * len(holdout))
        )
    notes.append('every fourth block of each record held out')
    both = [
        tuple(m & side(_folds(r)) for m, r in zip(masks, every, strict=True))
        for side in (np.logical_not, np.asarray)
    ]
    fit = Data(tuple(every), both[0], initials, recorded, origins, prior)
    held = replace(fit, masks=both[1])
    return _mended(Prepared(fit, held, tuple(notes), True, (NONE,) * n, ()))


def _mended(prepared: Prepared) -> Prepared:
    model, theta = Structure(()), despike.trimmed(prepared.fit)
    fit, notes = despike.without_frozen(prepared.fit, model, theta)
    if prepared.folded:
        held = replace(prepared.held, records=fit.records)
    else:
        held, told = despike.without_frozen(prepared.held, model, theta)
        notes += told
    prepared = replace(prepared, fit=fit, held=held, notes=(*notes, *prepared.notes))
    return prepared.without_impulses(model, theta)
