"""Impulses and frozen readings removed from records, without leverage on any fit, and reported."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from actuator_glue.hygiene import frozen
from actuator_glue.hygiene.checks import where
from actuator_glue.hygiene.frozen import Frozen
from actuator_glue.hygiene.impulses import NONE, Impulses, Motion, beyond, find, in_command
from actuator_glue.hygiene.rest import step
from actuator_glue.inference.least_squares import decimate
from actuator_glue.inference.least_squares.data import SETTLE, Data
from actuator_glue.inference.least_squares.fit import base_fit, fit
from actuator_glue.inference.least_squares.free_run import Model
from actuator_glue.model.exact import Initial
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array, Record

# How readings that nobody measured are told: what they do, where, and what that is.
_STOOD = 'stands still', 'while the piston must move', 'a frozen channel'
_STRAIGHT = (
    'runs on a straight line without noise',
    'where the piston must not',
    'missing samples that were filled in',
)
_DROPPED = 10  # repeats beyond which a reading may be that of a channel without signal
_TRIMS = 2  # refits without the samples that stood out of the last one


def _unsettled(record: Record, initial: Initial) -> int:
    """Samples skipped while the initial state decays: its transient is no impulse."""
    unknown = initial == 'measured' and record.duration > 2.0 * SETTLE
    return round(SETTLE / record.period) if unknown else 0


def trimmed(data: Data) -> Array:
    """Return parameters of Eq. (2) (4,) that gross errors of the measured channel do not bend.

    Least trimmed squares: samples that stand out of the residual are left out of the next refit.
    """
    model, found = Structure(()), base_fit(data).theta
    for _ in range(_TRIMS):
        errors = [
            record.measured - model.simulate(found, record, initial=initial)
            for record, initial in zip(data.records, data.initials, strict=True)
        ]
        rows = zip(data.masks, errors, data.periods, strict=True)
        masks = tuple(mask & ~beyond(e, period) for mask, e, period in rows)
        if all(np.array_equal(a, b) for a, b in zip(masks, data.masks, strict=True)):
            break
        found = fit(replace(data, masks=masks), model, found).theta
    return found


def without_impulses(
    data: Data, model: Model, theta: Array, known: Sequence[Impulses]
) -> tuple[Data, tuple[Impulses, ...]]:
    """Look for impulses in the residual of a model and take them out.

    Args:
        data: records.
        model: a structure.
        theta: its parameters (p,).
        known: impulses that were found with another model; they are judged again.

    Returns:
        The data less impulses and their share in the commands (the same object where `known` ones
        are found again and no others), and the impulses of each record.
    """
    records, all_ = [], []
    rows = zip(data.records, data.initials, data.origins, data.factors, known, strict=True)
    for record, initial, origin, count, before in rows:
        output = model.simulate(theta[None], record, initial=initial, origin=origin)[0]
        measured = record.measured.copy()
        measured[before.samples] += before.sizes
        moving = slice(_unsettled(record, initial), None)
        found = _found(output, measured, record.period, moving)
        found = replace(found, samples=found.samples + moving.start)
        if np.array_equal(found.samples, before.samples):
            found = before
        else:
            command = _less(record.command, before, -before.shared)
            # Where several samples became one, an impulse cannot be compared sample by sample.
            found = replace(found, shared=in_command(command, found) if count == 1 else 0.0)
            measured[found.samples] -= found.sizes
            record = replace(
                record, measured=measured, command=_less(command, found, found.shared)
            )
        records.append(record)
        all_.append(found)
    return _with(data, records), tuple(all_)


def _found(output: Array, measured: Array, period: float, moving: slice) -> Impulses:
    """Return the impulses of a measured displacement (n,) beside what a model says (n,) [m]."""

    def motion() -> Motion:
        speed = np.abs(np.gradient(output, period))
        # Far by the reading, too: a dropped-out channel is off only where the piston is far out.
        far = np.minimum(*(np.abs(y - np.median(y)) for y in (output, measured)))
        return Motion((speed[moving], far[moving]), _phase(output, measured)[moving])

    return find((measured - output)[moving], motion, period, step(measured))


def _less(channel: Array, found: Impulses, share: float) -> Array:
    """Return a channel (n,) less a share of some impulses; the same object if there are none."""
    if not share:
        return channel
    out = channel.copy()
    out[found.samples] -= share * found.sizes
    return out


def _with(data: Data, records: Sequence[Record]) -> Data:
    """Return data with other records; the same object where they are the same."""
    pairs = list(zip(records, data.records, strict=True))
    if all(a is b for a, b in pairs):
        return data
    if all(a.command is b.command for a, b in pairs):
        return replace(data, records=tuple(records))
    rows = zip(records, data.recorded, data.factors, strict=True)
    recorded = tuple(replace(w, command=r.command) if n == 1 else w for r, w, n in rows)
    return replace(data, records=tuple(records), recorded=recorded, steps=())


def _phase(output: Array, measured: Array) -> Array:
    """Phase of a motion (n,) in its plane of displacement and velocity [rad].

    NaN where the channel may have dropped out: such a reading repeats, and stands out only where
    the piston is away from it.
    """
    speed, away = np.gradient(output), output - np.median(output)
    phase = np.arctan2(
        speed / max(float(speed.std()), 1e-30), away / max(float(away.std()), 1e-30)
    )
    values, counts = np.unique(measured, return_counts=True)
    common = values[counts > max(_DROPPED, 3.0 * float(np.median(counts)))]
    return np.where(np.isin(measured, common), np.nan, phase)


def without_frozen(data: Data, model: Model, theta: Array) -> tuple[Data, list[str]]:
    """Bridge readings that stand still, or run straight, while a model does not.

    Returns:
        The data with the model's motion in place of such readings, and what was done.
    """
    records, notes = [], []
    rows = zip(data.records, data.recorded, data.factors, data.initials, strict=True)
    for i, (record, whole, count, initial) in enumerate(rows):
        records.append(record)
        repeats, lines = frozen.repeats(whole.measured), frozen.lines(whole.measured)
        if not len(repeats.first) and not len(lines.first):
            continue
        output = model.simulate(theta[None], record, initial=initial, origin=data.origins[i])[0]
        fine = output if count == 1 else np.interp(whole.time, record.time, output)
        for suspects, departing, said in (
            (repeats, frozen.while_moving, _STOOD),
            (lines, frozen.while_bending, _STRAIGHT),
        ):
            found = departing(suspects, whole, fine) if len(suspects.first) else suspects
            if len(found.first):
                notes.append(f'{where(record, i + 1)}: {_told_frozen(found, whole, *said)}')
                mended = frozen.bridged(records[i], found, output, count)
                records[i] = replace(record, measured=mended)
    return (replace(data, records=tuple(records)) if notes else data), notes


def _told_frozen(found: Frozen, whole: Record, how: str, when: str, what: str) -> str:
    sizes = found.last + 1 - found.first
    return (
        f'the measured displacement {how} {len(sizes)} time{"s" if len(sizes) > 1 else ""} '
        f'{when} ({int(sizes.sum())} of {len(whole)} samples, up to '
        f"{1e3 * float(sizes.max()) * whole.period:.3g} ms): {what}; the model's motion stands in "
        'their place'
    )


def told(records: Sequence[Record], impulses: Sequence[Impulses]) -> list[str]:
    """Return sentences on what was taken out of records."""
    pairs = zip(records, impulses, strict=False)
    return [f'{where(r, i + 1)}: {_told(n, r)}' for i, (r, n) in enumerate(pairs) if n.count]


def _told(found: Impulses, record: Record) -> str:
    up = float(np.mean(found.sizes > 0.0))
    side = ', all to one side' if up in (0.0, 1.0) and found.count > 4 else ''
    share = f'; {found.shared:.2f} of them in the command, too, and taken out there'
    both = share if found.shared else ''
    return (
        f'{found.count} impulse{"s" if found.count > 1 else ""} ({len(found.samples)} of '
        f'{len(record)} samples, up to {1e6 * float(np.abs(found.sizes).max()):.0f} um{side}) '
        f'are no motion: what the samples around them say stands in their place{both}'
    )


def despiked(
    records: Sequence[Record], initials: Sequence[Initial]
) -> tuple[list[Record], list[str], Array]:
    """Take impulses and frozen readings out of records, at the rate they were sampled with.

    Args:
        records: checked records of one actuator.
        initials: per record, the state it starts from.

    Returns:
        The records, what was done, for people, and parameters of Eq. (2) (4,) near their best fit.
    """
    slow = [decimate.decimated(r, decimate.factor(r)) for r in records]
    masks = [np.ones(len(r), dtype=np.bool_) for r in slow]
    for record, mask, initial in zip(slow, masks, initials, strict=True):
        mask[: _unsettled(record, initial)] = False
    whole = replace(Data.whole(slow), masks=tuple(masks), initials=tuple(initials))
    theta = trimmed(whole)
    as_given = replace(Data.whole(records), initials=tuple(initials))
    data, held = without_frozen(as_given, Structure(()), theta)
    data, found = without_impulses(data, Structure(()), theta, [NONE] * len(records))
    return list(data.records), held + told(data.records, found), theta
