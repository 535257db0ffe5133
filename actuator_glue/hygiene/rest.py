"""Noise and step of a channel at rest, beside what is taken for noise in motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from actuator_glue.hygiene.checks import where
from actuator_glue.inference.least_squares.data import SETTLE
from actuator_glue.model.exact import Initial
from actuator_glue.records import Array, Record

_SAMPLES = 100  # at least, at rest
_SURELY = 0.9  # of the rest: where it ends is not known to the sample
_APART = 1.5  # times as large is another noise
_ROUNDED = 1e-9  # of the range: the same reading


def noise_at_rest(record: Record, samples: int, initial: Initial = 'rest') -> float | None:
    """Return the rms about a line of the measured channel before anything moves [m].

    Args:
        record: the test.
        samples: number at its beginning in which the command does not move; None is returned if
            fewer than 100 of them are surely at rest.
        initial: where the piston starts; if it does not rest there, it first comes to rest.
    """
    begin = 0 if initial == 'rest' else round(SETTLE / record.period)
    y = record.measured[begin : round(_SURELY * samples)]
    samples = len(y)
    if samples < _SAMPLES:
        return None
    at = np.arange(samples) - 0.5 * (samples - 1)
    y = y - y.mean()
    y = y - at * (at @ y) / (at @ at)
    return float(np.sqrt(y @ y / (samples - 2)))


def step(readings: Array) -> float:
    """Return the least step between two readings of a channel (n,), in its unit."""
    apart = np.diff(np.unique(readings))
    apart = apart[apart > _ROUNDED * float(np.ptp(readings))]
    return float(apart.min()) if apart.size else 0.0


def compared(
    records: Sequence[Record], at_rest: Sequence[float | None], moving: float
) -> tuple[str, ...]:
    """Return sentences on records whose noise at rest is not that in motion.

    Args:
        records: as fitted.
        at_rest: of each [m].
        moving: what is taken for noise in motion, of all records [m].
    """
    out = []
    for i, (record, still) in enumerate(zip(records, at_rest, strict=True)):
        if still is None or not moving > 0.0 or still == 0.0:
            continue
        told = f'{where(record, i + 1)}: {1e6 * still:.1f} um of noise at rest, '
        if moving > _APART * still:
            more = 1e6 * (moving**2 - still**2) ** 0.5
            out.append(
                f'{told}{1e6 * moving:.1f} um in motion: {more:.1f} um come with the motion, as '
                'noise that grows with it, or as motion too irregular for any model here'
            )
        elif still > _APART * moving:
            out.append(
                f'{told}{1e6 * moving:.1f} um in motion: the channel calms down when it moves'
            )
    return tuple(out)
