"""The specimen stiffness of held-out records that do not say theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from actuator_glue.errors import InputError
from actuator_glue.records import Record


def with_stiffness(
    held: Sequence[Record], fitted: Sequence[Record]
) -> tuple[list[Record], tuple[str, ...]]:
    """Return held-out records that have a stiffness [N/m], and a note for each that was given one.

    The stiffness that all fitted records share is very likely that of a held-out test, too; where
    they have several, none is likelier than another. Where theirs are unknown, so it stays.

    Raises:
        InputError: a held-out record says no stiffness, and the fitted ones have several.
    """
    shared = list(dict.fromkeys(record.stiffness for record in fitted))
    out, notes = [], []
    for record in held:
        if record.stiffness is None and len(shared) == 1 and shared[0] is not None:
            notes.append(
                f'{record.source}: held out, and its specimen stiffness is not said; that of the '
                f'fitted records is taken, {shared[0]:.12g} N/m'
            )
            record = replace(record, stiffness=shared[0])
        elif record.stiffness is None and len(shared) > 1:
            known = ', '.join('unknown' if k is None else f'{k:.12g}' for k in shared)
            values = ' '.join(
                'K' if r.stiffness is None else f'{r.stiffness:.12g}' for r in fitted
            )
            raise InputError(
                f'{record.source}: the specimen stiffness of this held-out record is not known, '
                f'and the fitted records do not have one in common ({known} N/m); load it with '
                'its own stiffness, or on a command line add one value for each held-out record '
                f'to --stiffness, as in --stiffness {values} K'
            )
        out.append(record)
    return out, tuple(notes)
