"""Pictures of a run: forecast bands over what was measured, parameters against time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from actuator_glue.demo.bag import Content
from actuator_glue.errors import InputError
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array, Record

FREQUENCIES = (1.0, 5.0, 10.0)  # Hz, where the paper looks


def bands(content: Content, path: Path) -> Path:
    """Draw the forecast bands over the measured displacement, whole and at three zooms.

    Raises:
        InputError: the bag holds no scored bands.
    """
    from actuator_glue.report import style
    from actuator_glue.report.timeseries import band_over_measured

    total, limits = content.stitched('total'), content.stitched('parameter')
    if total is None or limits is None:
        raise InputError('the estimator published no bands; the run was shorter than a window')
    record, wide = total
    zooms, titles = _zooms(record)
    level = float(wide.levels[-1])
    figure = band_over_measured(
        record,
        limits[1],
        level=level,
        total=wide,
        zooms=zooms,
        zoom_titles=titles,
        title='Each band was fixed before its samples were measured',
    )
    return style.save(figure, path)


def parameters(content: Content, path: Path, truth: Array | None = None) -> Path:
    """Draw posterior mean and two standard deviations of each parameter against time.

    Args:
        content: the bag.
        path: where the picture goes.
        truth: true parameters of a simulated actuator, in the order of Eq. (2).

    Raises:
        InputError: the bag holds no posterior.
    """
    from actuator_glue.report import style
    from actuator_glue.report.timeseries import parameters_against_time

    if not content.posteriors:
        raise InputError('the estimator published no posterior; the run was shorter than a window')
    last = content.posteriors[-1]
    same = [p for p in content.posteriors if list(p.parameter_names) == list(last.parameter_names)]
    first = content.record.first_index
    end = [(int(p.index) + int(p.samples) - first) * float(p.period) for p in same]
    mean, spread = np.array([p.mean for p in same]), np.array([p.stddev for p in same])
    columns = [
        Parameter(name, unit, 0.0, np.inf, name)
        for name, unit in zip(last.parameter_names, last.units, strict=True)
    ]
    figure = parameters_against_time(
        np.array(end),
        mean,
        np.maximum(mean - 2 * spread, 0.0) if len(columns) == 4 else mean - 2 * spread,
        mean + 2 * spread,
        columns,
        truth=truth,
        title='Posterior of each window against the time of its last sample',
        band_name='mean +- 2 standard deviations',
    )
    return style.save(figure, path)


def _zooms(record: Record) -> tuple[list[tuple[float, float]], list[str]]:
    from actuator_glue.inference.scores import instantaneous_frequency
    from actuator_glue.report.timeseries import even_zooms, frequency_zooms

    try:
        frequency = instantaneous_frequency(record.command, record.period)
        swept = frequency.max() > 1.5 * FREQUENCIES[0] and frequency.min() <= FREQUENCIES[0]
    except InputError:
        swept = False
    if not swept:
        zooms = even_zooms(record)
        return zooms, [f'at {start:.0f} s' for start, _ in zooms]
    reached = [min(f, float(frequency.max())) for f in FREQUENCIES]
    return frequency_zooms(record, reached), [f'near {f:.3g} Hz' for f in reached]
