"""Records made ready for any fit: checked, filled, zeroed, without glitches of their commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from actuator_glue import robust
from actuator_glue.hygiene import glitches, slow_channel
from actuator_glue.hygiene.checks import beside_stated, check, where
from actuator_glue.hygiene.repeats import refuse_repeats
from actuator_glue.model.exact import Initial
from actuator_glue.records import Record

_MOVED = 2e-3  # of its largest excursion: a command within it has not begun
_HEAD = 0.5  # s that show where it rests and how noisy its channel is
_SMOOTH = 0.03  # s
_REST = 1.5  # s of constant command that define the zero of both channels
# Share of its range that a channel may be away from zero, or move within a moment, at rest.
_STILL = 0.05
_MOMENT = 0.02  # s


def rest_samples(record: Record) -> int:
    """Samples at the beginning in which the command does not move.

    The command is smoothed over a few hundredths of a second: one that was recorded by a noisy
    channel does not move with every sample.
    """
    head = record.command[: max(2, round(_HEAD / record.period))]
    width = max(1, round(_SMOOTH / record.period))
    centre = float(np.median(head))
    noise = robust.deviation(head, centre) / np.sqrt(width)
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


def common_initial(records: Sequence[Record]) -> Initial:
    """Return the state in which all of some records start: at rest only where each does."""
    return 'rest' if all(initial_state(r) == 'rest' for r in records) else 'measured'


def clean(
    records: Sequence[Record], holdout: Sequence[Record] = ()
) -> tuple[list[Record], list[str]]:
    """Check records, fill channels slower than the recorder, zero them, remove command glitches.

    Returns:
        The records in the order given, held-out ones last, and what was done or seems doubtful,
        for people.

    Raises:
        InputError: a record that cannot be fitted, given twice, or fitted and held out.
    """
    every = [*records, *holdout]
    for i, record in enumerate(every):
        check(record, i + 1)
    refuse_repeats(records, holdout)
    stiffnesses = beside_stated(every)
    every, notes = slow_channel.measured_filled(every)
    every, more = zeroed(every)
    initials = [initial_state(r) for r in every]
    every, filled = slow_channel.command_filled(every, initials)
    every, glitches_told = glitches.mended(every, initials)
    return every, [*stiffnesses, *glitches_told, *notes, *filled, *more]
