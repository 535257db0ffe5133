"""Check and zero records before any look at them, and set the held-out part aside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator_glue.diagnosis.scopes.hold_and_stiffness import WrongSetup
from actuator_glue.diagnosis.scopes.moments import Moment
from actuator_glue.errors import InputError
from actuator_glue.hygiene import impulse_removal, slow_channel
from actuator_glue.hygiene.checks import where
from actuator_glue.hygiene.clean import clean, initial_state
from actuator_glue.hygiene.impulses import NONE, Impulses
from actuator_glue.inference.least_squares import decimate
from actuator_glue.inference.least_squares.base_prior import BasePrior
from actuator_glue.inference.least_squares.data import SETTLE, Data, Mask
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Hold, Record

_SHORTEST = 5.0  # s
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
        impulses: what was taken out of each fitting record (see hygiene/impulse_removal.py).
        held_impulses: the same for each separate held-out record.
        setup: set-up of the records taken instead of the given one; None for the given one.
        also: effects that are tried beside the usual ones.
    """

    fit: Data
    held: Data
    notes: tuple[str, ...]
    folded: bool
    impulses: tuple[Impulses, ...]
    held_impulses: tuple[Impulses, ...]
    setup: WrongSetup | None = None
    also: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was done to the records, impulses first, for people."""
        return (
            *impulse_removal.told(self.fit.records, self.impulses),
            *impulse_removal.told(self.held.records, self.held_impulses),
            *self.notes,
        )

    def without_impulses(self, model: Model, theta: Array) -> Prepared:
        """Remove impulses judged against a model; the same object if nothing changes.

        Samples that were impulses only by another model are restored.
        """
        fit, found = impulse_removal.without_impulses(self.fit, model, theta, self.impulses)
        if self.folded:
            held, others = replace(fit, masks=self.held.masks), self.held_impulses
        else:
            held, others = impulse_removal.without_impulses(
                self.held, model, theta, self.held_impulses
            )
        if fit is self.fit and (self.folded or held is self.held):
            return self
        return replace(self, fit=fit, held=held, impulses=found, held_impulses=others)

    def with_hold(self, hold: Hold, setup: WrongSetup | None) -> Prepared:
        """Return the records with another hold of their commands; `setup` is None if as given."""
        fit, held = (data.with_setup(hold=hold) for data in (self.fit, self.held))
        return replace(self, fit=fit, held=held, setup=setup)

    def since(self, moment: Moment) -> Prepared:
        """Leave out the data before a moment; separate held-out records are taken to be later."""
        fit = moment.split(self.fit)[1]
        held = moment.split(self.held)[1] if self.folded else self.held
        pairs = zip(self.fit.recorded, self.impulses, strict=True)
        kept = tuple(i for r, i in pairs if any(r is k for k in fit.recorded))
        return replace(self, fit=fit, held=held, impulses=kept)


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
    for i, (given, record) in enumerate(zip((*records, *holdout), recorded, strict=True)):
        count = decimate.factor(record)
        why = f'what moves in it needs (motion up to {decimate.motion_bandwidth(record):.3g} Hz)'
        if (known := slow_channel.readings(given.measured)) is not None:
            least, count = count, decimate.factor_of_readings(record, known.every)
            why = 'its measured channel gives' if count > least else why
        every.append(decimate.decimated(record, count))
        if count > 1:
            notes.append(
                f'{where(record, i + 1)}: {record.rate:g} Hz are more than {why}: means over '
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
    model, theta = Structure(()), impulse_removal.trimmed(prepared.fit)
    fit, notes = impulse_removal.without_frozen(prepared.fit, model, theta)
    if prepared.folded:
        held = replace(prepared.held, records=fit.records)
    else:
        held, told = impulse_removal.without_frozen(prepared.held, model, theta)
        notes += told
    prepared = replace(prepared, fit=fit, held=held, notes=(*notes, *prepared.notes))
    return prepared.without_impulses(model, theta)
