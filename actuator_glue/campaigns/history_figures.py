"""Pictures of an actuator's history: each number over the days, with its intervals and changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from actuator_glue.campaigns.history_data import HistoryData
from actuator_glue.model.parameters import BASE
from actuator_glue.records import Array
from actuator_glue.report import style

_DAY = 'datetime64[D]'


@style.styled
def levels(found: HistoryData) -> Figure:
    """Draw each parameter of Eq. (2): tests with their intervals, level with its band, changes."""
    pooled, series = found.pooled, found.series
    units = {p.name: p.unit for p in BASE}
    figure = style.new_figure(1.7 * len(pooled.names) + 0.4)
    rows = figure.subplots(len(pooled.names), 1, sharex=True, squeeze=False)[:, 0]
    days = np.array(series.days, dtype=_DAY)
    for i, axes in enumerate(rows):
        one = np.sqrt(series.covariance[:, i, i])
        middle, low, high = (np.exp(series.mean[:, i] + z * one) for z in (0.0, -1.96, 1.96))
        band = [np.exp(pooled.level[:, i] + z * pooled.level_stddev[:, i]) for z in (-1.96, 1.96)]
        exponent = style.engineering(middle)
        unit = 10.0**exponent
        axes.fill_between(days, band[0] / unit, band[1] / unit, color=style.LIGHT_BAND, alpha=0.5)
        axes.plot(days, np.exp(pooled.level[:, i]) / unit, color=style.BAND)
        _bars(axes, days, middle / unit, low / unit, high / unit)
        axes.set_ylabel(style.label(pooled.names[i], units[pooled.names[i]], exponent))
        _marks(axes, found)
    _dates(rows[-1])
    return figure


@style.styled
def numbers(found: HistoryData, columns: Sequence[tuple[str, str, float]]) -> Figure:
    """Draw numbers of the rows over the days, each with its interval where it has one.

    Args:
        found: the history.
        columns: name of a column (`NAME_mean` with `_lower` and `_upper`, or itself), its label,
            and the factor from SI to it.
    """
    table = found.table[found.table['failure'] == '']
    days = table['day'].to_numpy(dtype=str).astype(_DAY)
    figure = style.new_figure(1.6 * len(columns) + 0.4)
    rows = figure.subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (name, label, factor) in zip(rows, columns, strict=True):
        if f'{name}_mean' in table:
            middle, low, high = (
                factor * table[f'{name}_{what}'].to_numpy(dtype=np.float64)
                for what in ('mean', 'lower', 'upper')
            )
            _bars(axes, days, middle, low, high)
        else:
            axes.plot(
                days,
                factor * table[name].to_numpy(dtype=np.float64),
                '.',
                ms=3,
                color=style.MEASURED,
            )
        axes.set_ylabel(label)
        _marks(axes, found)
    _dates(rows[-1])
    return figure


def _bars(axes: Any, days: Array, middle: Array, low: Array, high: Array) -> None:
    axes.vlines(days, low, high, color=style.COMMAND, lw=0.6)
    axes.plot(days, middle, '.', ms=3, color=style.MEASURED)


def _marks(axes: Any, found: HistoryData) -> None:
    for change in found.changes:
        axes.axvline(np.datetime64(change.day), color=style.DETERMINISTIC, lw=1.2, ls='--')


def _dates(axes: Any) -> None:
    axes.tick_params(axis='x', rotation=20)
