"""The end of the demonstration: what the model lacked, and the error before and after."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from actuator_glue.records import Record
from actuator_glue.report import style
from actuator_glue.report.diagnosis_figures import stretches
from actuator_glue.residual.diagnose import diagnose
from actuator_glue.residual.diagnosis import Diagnosis, Trace

UM = 1e6
MM = 1e3
POINTS = 4000  # in a scatter plot; more only blacken it
SECONDS = 0.6  # of residual drawn against time


def find(record: Record, seed: int, progress: Callable[[str, float], None]) -> Diagnosis:
    """Diagnose one record, part of which is set aside for the error before and after.

    Raises:
        InputError: the record cannot be diagnosed.
    """
    return diagnose([record], seed=seed, jobs=2, progress=progress, clock=perf_counter)


def verdict(diagnosis: Diagnosis) -> list[str]:
    """Return what people want to know, line by line."""
    error = diagnosis.error
    lines = [f'diagnosis {diagnosis.summary()}']
    for effect in diagnosis.effects:
        sizes = ', '.join(
            f'{name} {p.mean:.4g} +- {p.stddev:.2g} {p.unit}'
            for name, p in effect.parameters.items()
        )
        lines.append(f'          {effect.name} ({effect.place}): {sizes}')
    if diagnosis.effects:
        base = [
            f'{name} {p.mean:.4g} +- {p.stddev:.2g} {p.unit}' for name, p in diagnosis.base.items()
        ]
        lines.append(f'          with it {", ".join(base)}')
    low, high = error.after_ci
    lines.append(
        f'error     {UM * error.before:.2f} um before, {UM * error.after:.2f} um after '
        f'[{UM * low:.2f}, {UM * high:.2f}], noise {UM * error.noise_floor:.2f} um, held-out data'
    )
    return lines


def picture(diagnosis: Diagnosis, path: Path) -> Path:
    """Draw the held-out residual before and after, against time and against displacement."""
    held = [t for t in diagnosis.traces if t.held_out]
    trace = max(held or diagnosis.traces, key=lambda t: len(t.measured))
    return style.save(_draw(diagnosis, trace), path)


@style.styled
def _draw(diagnosis: Diagnosis, trace: Trace) -> Figure:
    figure = style.new_figure(4.6)
    panels = figure.subplots(2, 2, sharex='col', sharey=True, width_ratios=(1.7, 1.0))
    with_effects = ' + '.join(['Eq. (2)', *diagnosis.structure])
    rows = (
        ('Eq. (2) alone', trace.before, diagnosis.error.before, style.DETERMINISTIC),
        (with_effects, trace.after, diagnosis.error.after, style.BAND),
    )
    part, pick = _stretch(trace), _thin(len(trace.time))
    limit = 1.15 * UM * float(np.quantile(np.abs(trace.measured - trace.before), 0.999))
    for (name, simulated, rms, colour), (left, right) in zip(rows, panels, strict=True):
        residual = UM * (trace.measured - simulated)
        left.plot(trace.time[part], residual[part], color=colour, lw=0.8)
        right.plot(MM * trace.measured[pick], residual[pick], '.', ms=1.5, color=colour)
        left.set(ylim=(-limit, limit), ylabel='residual [um]')
        left.set_title(f'{name}: {UM * rms:.1f} um rms')
    panels[1, 0].set_xlabel('time [s]')
    panels[1, 1].set_xlabel('displacement [mm]')
    figure.suptitle(
        f'Error on data that decided nothing: {UM * diagnosis.error.before:.1f} -> '
        f'{UM * diagnosis.error.after:.1f} um, noise {UM * diagnosis.error.noise_floor:.1f} um'
    )
    return figure


def _stretch(trace: Trace) -> slice:
    """Return a short stretch without a hole, of the longest one in the middle of the record."""
    period = float(np.median(np.diff(trace.time)))
    pieces = stretches(trace)
    piece = pieces[len(pieces) // 2]
    size = piece.stop - piece.start
    length = min(size, max(2, round(SECONDS / period)))
    start = piece.start + (size - length) // 2
    return slice(start, start + length)


def _thin(count: int) -> NDArray[np.intp]:
    return np.unique(np.linspace(0, count - 1, min(count, POINTS)).astype(np.intp))
