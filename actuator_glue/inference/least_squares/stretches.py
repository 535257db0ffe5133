"""Stretches of long records: enough to tell roughly how large an effect is, at a part of the cost.

They are spread evenly over every record, so over a sweep's frequencies and amplitudes too, and
start from the measured state. What they lead to is finished, and judged, on all samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator_glue.inference.least_squares.data import SETTLE, Data
from actuator_glue.model.exact import Initial

_LENGTH = 5.0  # s of a stretch, its settling not counted
_TOTAL = 60.0  # s of all stretches
_LONG = 2.0  # times as much as them: shorter records are taken whole


@dataclass(frozen=True)
class Part:
    """A part of some data, or all of it.

    Attributes:
        data: the part, each stretch a record of its own.
        rows: where its counted samples lie in the joined vectors of the whole.
        records: from which record of the whole each of its records is.
    """

    data: Data
    rows: NDArray[np.intp] | slice
    records: tuple[int, ...]

    @classmethod
    def whole(cls, data: Data) -> Part:
        """Return all of some data."""
        return cls(data, slice(None), tuple(range(len(data.records))))


def stretches(data: Data, most: float = _TOTAL) -> Part | None:
    """Return stretches that stand for long records; None where the records are not long.

    Args:
        data: the records.
        most: length of all stretches [s].
    """
    total = sum(record.duration for record in data.records)
    if total < _LONG * most:
        return None
    records, masks, initials, origins, rows, of = [], [], [], [], [], []
    for i, (record, mask) in enumerate(zip(data.records, data.masks, strict=True)):
        place = data.parts[i].start + np.cumsum(mask) - 1
        count = max(1, round(most * record.duration / total / _LENGTH))
        size = min(len(record), round((_LENGTH + SETTLE) / record.period))
        for begin in np.linspace(0, len(record) - size, count).astype(int).tolist():
            initial: Initial = data.initials[i] if begin == 0 else 'measured'
            own = mask[begin : begin + size].copy()
            if initial == 'measured':
                own[: round(SETTLE / record.period)] = False
            if not own.any():
                continue
            records.append(record.slice(begin, begin + size))
            masks.append(own)
            initials.append(initial)
            origins.append(data.origins[i] + begin * record.period)
            rows.append(place[begin : begin + size][own])
            of.append(i)
    some = tuple(records)
    part = Data(some, tuple(masks), tuple(initials), some, tuple(origins), data.prior)
    return Part(part, np.concatenate(rows), tuple(of))
