"""Pictures of a live estimate: forecast bands over what was measured, parameters against time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.model.parameters import NAMES, Parameter
from actuator_glue.records import Array, Record
from actuator_glue.report import style
from actuator_glue.report.bag_content import Content
from actuator_glue.report.frequency import instantaneous_frequency
from actuator_glue.report.timeseries import (
    Bands,
    ParameterCourse,
    band_at_zooms,
    even_zooms,
    frequency_zooms,
    parameters_against_time,
)

FREQUENCIES = (1.0, 5.0, 10.0)  # Hz, where the paper looks
CYCLES = 2.0  # of the command in each zoom


def bands(content: Content, path: Path) -> Path:
    """Draw the forecast bands over the measured displacement at three zooms.

    Raises:
        InputError: the bag holds no scored bands.
    """
    total, parameter = content.stitched('total'), content.stitched('parameter')
    if total is None or parameter is None:
        raise InputError('the estimator published no bands; the run was shorter than a window')
    known = np.flatnonzero(np.isfinite(total.median))
    zooms, titles = _zooms(content.record, int(known[0]), int(known[-1]) + 1)
    level = float(total.levels[-1])
    share = content.coverage('total')[f'{level:g}']
    figure = band_at_zooms(
        content.record,
        Bands(parameter, total, level=level),
        zooms,
        zoom_titles=titles,
        title=f'Forecasts: {100 * share:.1f} % of the samples lie in their total '
        f'{100 * level:g} % band',
    )
    return style.save(figure, path)


def parameters(content: Content, path: Path, truth: Array | None = None) -> Path:
    """Draw posterior mean and two standard deviations of each parameter against time.

    Args:
        content: the bag.
        path: where the picture goes.
        truth: true parameters of a simulated actuator in each window, in the order of Eq. (2),
            shape (windows, 4).

    Raises:
        InputError: the bag holds no posterior.
    """
    if not content.posteriors:
        raise InputError('the estimator published no posterior; the run was shorter than a window')
    last = content.posteriors[-1]
    first = content.record.first_index
    end = [(int(p.index) + int(p.samples) - first) * float(p.period) for p in content.posteriors]
    mean, spread = (
        np.array([_by_name(p, getattr(p, column), last) for p in content.posteriors])
        for column in ('mean', 'stddev')
    )
    columns = [
        Parameter(name, unit, 0.0, np.inf, name)
        for name, unit in zip(last.parameter_names, last.units, strict=True)
    ]
    if truth is not None:
        unknown = np.full((len(truth), len(columns) - truth.shape[1]), np.nan)
        truth = np.hstack([truth, unknown])
    # No parameter of Eq. (2) is negative.
    least = [0.0 if name in NAMES else -np.inf for name in last.parameter_names]
    figure = parameters_against_time(
        ParameterCourse(
            np.array(end),
            mean,
            np.maximum(mean - 2 * spread, least),
            mean + 2 * spread,
            'mean +- 2 standard deviations',
        ),
        columns,
        truth=truth,
        # Told by the last windows: the first ones are short of samples.
        prior_dominated=np.mean(
            [_by_name(p, p.prior_dominated, last) for p in content.posteriors[-5:]], axis=0
        )
        > 0.5,
        title='Posterior of each window against the time of its last sample',
    )
    return style.save(figure, path)


def _by_name(posterior: Any, values: Sequence[float], wanted: Any) -> list[float]:
    """Return values in the order of another posterior's parameters, NaN for those it lacks."""
    known = dict(zip(posterior.parameter_names, values, strict=True))
    return [float(known.get(name, np.nan)) for name in wanted.parameter_names]


def _zooms(record: Record, start: int, stop: int) -> tuple[list[tuple[float, float]], list[str]]:
    """Return three time spans [s] between two samples, and their titles."""
    part = record.slice(start, stop)
    offset = start * record.period
    try:
        frequency = instantaneous_frequency(part.command, part.period)
        low, high = np.quantile(frequency, (0.01, 0.99))
    except InputError:
        low = high = 0.0
    wanted = [float(np.clip(f, low, high)) for f in FREQUENCIES]
    if len(set(wanted)) == len(wanted):
        zooms = frequency_zooms(part, wanted, CYCLES)
        titles = [f'near {f:.2g} Hz' for f in wanted]
    else:
        zooms = even_zooms(part, CYCLES)
        titles = [f'{offset + first:.0f} s' for first, _ in zooms]
    return [(offset + first, offset + last) for first, last in zooms], titles
