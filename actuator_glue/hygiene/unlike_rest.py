"""Supposed noise in motion that is none, because the channel at rest shows far less."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from actuator_glue.hygiene.checks import where
from actuator_glue.hygiene.clean import initial_state, rest_samples
from actuator_glue.hygiene.rest import noise_at_rest, step
from actuator_glue.records import Record

# Times the noise at rest that no transducer, oil or stand adds in motion; and the share of the
# spread measured below which nobody minds.
_TIMES, _SHARE = 10.0, 0.01


def unlike_rest(records: Sequence[Record], moving: float) -> tuple[str, ...]:
    """Return a sentence on each record whose noise in motion cannot be noise.

    Args:
        records: as they were measured.
        moving: what is taken for noise in motion, of all records [m].
    """
    out = []
    for i, record in enumerate(records):
        still = noise_at_rest(record, rest_samples(record), initial_state(record))
        if still is None or moving < _SHARE * float(record.measured.std()):
            continue
        # A channel that reads the same at rest may be off by up to half of its step.
        known = max(still, step(record.measured) / np.sqrt(12.0))
        if moving > _TIMES * known:
            out.append(
                f'{where(record, i + 1)}: {1e6 * moving:.3g} um are taken for noise, and the '
                f'channel at rest has {1e6 * known:.3g} um: it is motion that no model here '
                'explains; check clock, command channel and what else moves'
            )
    return tuple(out)
