"""Curves of records for pictures: measured, and simulated before and after, with bands."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from actuator_glue.diagnosis.verdict.held_out_look import BandCurves
from actuator_glue.inference.least_squares.data import Data
from actuator_glue.records import Array


@dataclass(frozen=True, slots=True)
class Trace:
    """Curves of one record for pictures: time [s], command, measurement, simulations (n,) [m].

    `lower_*` and `upper_*` are the limits of the 95 % predictive band before and after (n,) [m].
    """

    source: str
    held_out: bool
    time: Array
    stiffness: float
    command: Array
    measured: Array
    before: Array
    after: Array
    lower_before: Array
    upper_before: Array
    lower_after: Array
    upper_after: Array

    def stretches(self) -> list[slice]:
        """Return the stretches that have no gap: what is held out leaves gaps."""
        step = np.diff(self.time)
        edges = np.flatnonzero(step > 1.5 * float(np.median(step))) + 1
        return [slice(a, b) for a, b in pairwise([0, *edges.tolist(), len(self.time)])]


def traces(data: Data, held_out: bool, curves: tuple[BandCurves, BandCurves]) -> list[Trace]:
    """Cut the joined curves of one part of the records, before and after, into records."""

    def joined(side: BandCurves) -> tuple[Array, Array]:
        if held_out:
            return side.held, side.held_width
        return side.fitted, side.fitted_width

    (before, before_width), (after, after_width) = map(joined, curves)
    out = []
    for i, (record, mask, part) in enumerate(
        zip(data.records, data.masks, data.parts, strict=True)
    ):
        b, wb, a, wa = before[part], before_width[part], after[part], after_width[part]
        out.append(
            Trace(
                source=record.source or f'record {i + 1}',
                held_out=held_out,
                time=record.time[mask],
                stiffness=record.known_stiffness(),
                command=record.command[mask],
                measured=record.measured[mask],
                before=b,
                after=a,
                lower_before=b - wb,
                upper_before=b + wb,
                lower_after=a - wa,
                upper_after=a + wa,
            )
        )
    return out
