"""What a live estimator left in a bag: records, posteriors, bands, health."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.inference.bands import Band
from actuator_glue.io.bag_reader import messages
from actuator_glue.io.bag_records import read_records
from actuator_glue.io.messages import deserialize, full_name
from actuator_glue.records import Array, Record

WANTED = {
    full_name(name): name
    for name in ('PosteriorMoments', 'PredictionBand', 'FrequencyResponseBand')
} | {'diagnostic_msgs/msg/DiagnosticArray': 'DiagnosticArray'}


@dataclass(slots=True)
class Content:
    """A bag in memory, bands and posteriors only where they belong to `record`.

    Attributes:
        record: the longest stretch without a gap.
        samples: samples in the whole bag.
        posteriors: PosteriorMoments in the order of their windows.
        bands: scored PredictionBands in order.
        response: the last FrequencyResponseBand, None without one.
        health: last values of each node on /diagnostics, by node and key.
    """

    record: Record
    samples: int
    posteriors: list[Any] = field(default_factory=list)
    bands: list[Any] = field(default_factory=list)
    response: Any = None
    health: dict[str, dict[str, str]] = field(default_factory=dict)

    def stitched(self, kind: str) -> Band | None:
        """Join the scored bands of one kind over the whole record, NaN where there is none.

        Where two bands cover a sample the later one holds. None without such bands.
        """
        parts = [b for b in self.bands if b.kind == kind]
        if not parts:
            return None
        levels = np.asarray(parts[0].levels)
        count, n = len(levels), len(self.record)
        joined = np.full((2 * count + 1, n), np.nan)
        for part in parts:
            rows = np.vstack([_rows(part.lower, count), part.median, _rows(part.upper, count)])
            at = int(part.index) - self.record.first_index
            first, stop = max(at, 0), min(at + rows.shape[1], n)
            if first < stop:
                joined[:, first:stop] = rows[:, first - at : stop - at]
        return Band(levels, joined[:count], joined[count], joined[count + 1 :])

    def coverage(self, kind: str) -> dict[str, float]:
        """Return level -> share of measured samples inside the scored bands of one kind."""
        parts = [b for b in self.bands if b.kind == kind]
        if not parts:
            return {}
        weights = [len(b.median) for b in parts]
        shares = np.average([b.coverage for b in parts], axis=0, weights=weights)
        return {f'{level:g}': float(s) for level, s in zip(parts[0].levels, shares, strict=True)}

    def mean_width(self, kind: str, level: float) -> float:
        """Return the mean width of the bands of one kind and level [m]; NaN without such."""
        parts = [b for b in self.bands if b.kind == kind]
        widths = [w for b in parts for lv, w in zip(b.levels, b.width, strict=True) if lv == level]
        return float(np.mean(widths)) if widths else float('nan')


def _rows(flat: Array, count: int) -> Array:
    return np.asarray(flat, dtype=np.float64).reshape(count, -1)


def read(bag: Path) -> Content:
    """Read a finished bag.

    Raises:
        InputError: it is damaged or holds no samples.
    """
    records = read_records(bag, gap=lambda _: None)
    content = Content(max(records, key=len), sum(len(r) for r in records))
    for found in messages(bag, types=WANTED):
        message = deserialize(found.type, found.data, found.definition)
        kind = WANTED[found.type]
        if kind == 'PosteriorMoments':
            content.posteriors.append(message)
        elif kind == 'PredictionBand' and message.scored:
            content.bands.append(message)
        elif kind == 'FrequencyResponseBand':
            content.response = message
        elif kind == 'DiagnosticArray':
            for status in message.status:
                values = {v.key: v.value for v in status.values}
                content.health[status.name.rpartition('/')[2]] = values
    return content
