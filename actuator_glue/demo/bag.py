"""What a finished bag holds, as the demonstration reports it."""

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
    for name in ('PosteriorMoments', 'PredictionBand', 'EstimatorSetup', 'Diagnosis')
} | {'diagnostic_msgs/msg/DiagnosticArray': 'DiagnosticArray'}


@dataclass(slots=True)
class Content:
    """A bag in memory, bands and posteriors only where they belong to `record`.

    Attributes:
        record: the longest stretch without a gap.
        samples: samples in the whole bag.
        gaps: one line per gap.
        posteriors: PosteriorMoments in the order of their windows.
        bands: scored PredictionBands in order.
        diagnoses: Diagnosis messages.
        health: last values of each node on /diagnostics, by node and key.
    """

    record: Record
    samples: int
    gaps: list[str]
    posteriors: list[Any] = field(default_factory=list)
    bands: list[Any] = field(default_factory=list)
    diagnoses: list[Any] = field(default_factory=list)
    health: dict[str, dict[str, str]] = field(default_factory=dict)

    def stitched(self, kind: str) -> tuple[Record, Band] | None:
        """Join the scored bands of one kind; return them with the record they lie over.

        Where two bands cover a sample the later one holds. None without such bands.
        """
        parts = [b for b in self.bands if b.kind == kind]
        if not parts:
            return None
        first = self.record.first_index
        start = min(int(b.index) for b in parts) - first
        stop = max(int(b.index) + len(b.median) for b in parts) - first
        start, stop = max(start, 0), min(stop, len(self.record))
        levels = np.asarray(parts[0].levels)
        joined = np.full((2 * len(levels) + 1, stop - start), np.nan)
        for part in parts:
            rows = np.vstack(
                [_rows(part.lower, levels), np.asarray(part.median), _rows(part.upper, levels)]
            )
            at = int(part.index) - first - start
            joined[:, at : at + rows.shape[1]] = rows[:, : stop - start - at]
        known = np.flatnonzero(np.isfinite(joined).all(axis=0))
        start, stop = start + int(known[0]), start + int(known[-1]) + 1
        joined = joined[:, known[0] : known[-1] + 1]
        count = len(levels)
        band = Band(levels, joined[:count], joined[count], joined[count + 1 :])
        return self.record.slice(start, stop), band

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


def _rows(flat: Array, levels: Array) -> Array:
    return np.asarray(flat, dtype=np.float64).reshape(len(levels), -1)


def read(bag: Path) -> Content:
    """Read a finished bag.

    Raises:
        InputError: it is damaged or holds no samples.
    """
    gaps: list[str] = []
    records = read_records(bag, gap=gaps.append)
    content = Content(max(records, key=len), sum(len(r) for r in records), gaps)
    for found in messages(bag, types=WANTED):
        message = deserialize(found.type, found.data)
        kind = WANTED[found.type]
        if kind == 'PosteriorMoments':
            content.posteriors.append(message)
        elif kind == 'PredictionBand' and message.scored:
            content.bands.append(message)
        elif kind == 'Diagnosis':
            content.diagnoses.append(message)
        elif kind == 'DiagnosticArray':
            for status in message.status:
                values = {v.key: v.value for v in status.values}
                content.health[status.name.rpartition('/')[2]] = values
    return content
