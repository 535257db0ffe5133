"""Figures along time: bands over the measured displacement, parameters against time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib.colors
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator_glue.errors import InputError
from actuator_glue.inference.bands import Band
from actuator_glue.inference.scores import instantaneous_frequency
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array, Record
from actuator_glue.report import style

Zoom = tuple[float, float]
MM = 1e3
# Either band may be the wider one: the total one is drawn by its edges.
TOTAL_LOOK: dict[str, Any] = {
    'facecolor': matplotlib.colors.to_rgba(style.TOTAL, 0.15),
    'edgecolor': style.TOTAL,
    'linewidth': 0.8,
}


def frequency_zooms(
    record: Record, frequencies_hz: Sequence[float] = (1.0, 5.0, 10.0), cycles: float = 2.0
) -> list[Zoom]:
    """Return time spans [s] of a few cycles about the first moment the command has a frequency.

    Frequencies the command never reaches give its last moment of the nearest one, so that a
    sweep ending at 10 Hz has a zoom at 10 Hz.

    Raises:
        InputError: the command has no frequency (see `instantaneous_frequency`).
    """
    frequency = instantaneous_frequency(record.command, record.period)
    time = record.time
    spans = []
    for wanted in frequencies_hz:
        reached = np.flatnonzero(frequency >= wanted)
        at = time[reached[0]] if reached.size else time[int(np.argmax(frequency))]
        length = cycles / wanted
        start = float(np.clip(at - length / 2, 0.0, max(0.0, time[-1] - length)))
        spans.append((start, start + length))
    return spans


def even_zooms(record: Record, cycles: float = 4.0) -> list[Zoom]:
    """Return three time spans [s] at 1/6, 1/2 and 5/6 of a record, a few local cycles long."""
    try:
        frequency = instantaneous_frequency(record.command, record.period)
    except InputError:
        frequency = np.full(len(record), 20.0 * cycles / record.duration)
    spans = []
    for share in (1 / 6, 1 / 2, 5 / 6):
        at = int(share * len(record))
        length = min(cycles / max(float(frequency[at]), 1e-9), record.duration / 4)
        spans.append((at * record.period - length / 2, at * record.period + length / 2))
    return spans


@style.styled
def band_over_measured(
    record: Record,
    limits: Band,
    *,
    level: float = 0.95,
    total: Band | None = None,
    deterministic: Array | None = None,
    zooms: Sequence[Zoom] | None = None,
    zoom_titles: Sequence[str] | None = None,
    title: str = '',
    band_name: str = 'GLUE band',
) -> Figure:
    """Draw bands over the measured displacement: the whole record, then zooms side by side.

    Args:
        record: command and measured displacement, n samples.
        limits: parameter (GLUE) band [m], n samples.
        level: which level of the bands to draw.
        total: total predictive band [m], drawn lighter behind.
        deterministic: response of one parameter set, shape (n,) [m].
        zooms: time spans [s]; three even ones where not given.
        zoom_titles: one title per zoom.
        title: title of the figure.
        band_name: what the narrow band is called in the legend.

    Raises:
        InputError: a band or response of another length, or without this level.
    """
    _same_length(record, limits, total, deterministic)
    spans = list(zooms) if zooms is not None else even_zooms(record)
    figure = style.new_figure(5.0)
    grid = figure.add_gridspec(2, len(spans), height_ratios=(1.0, 1.35))
    whole = figure.add_subplot(grid[0, :])
    panels = [figure.add_subplot(grid[1, i]) for i in range(len(spans))]
    # Hundreds of cycles: only the envelopes can be read, so thin lines and no dashes.
    whole.plot(record.time, MM * record.command, color=style.COMMAND, lw=0.4, alpha=0.5)
    whole.plot(record.time, MM * record.measured, color=style.MEASURED, lw=0.5)
    for axes in panels:
        _draw(axes, record, limits, level, total, deterministic, band_name)
    whole.set(xlim=(0, record.duration), ylabel='displacement [mm]', xlabel='time [s]')
    for i, (axes, (start, stop)) in enumerate(zip(panels, spans, strict=True)):
        _zoom(axes, record, start, stop)
        axes.set_xlabel('time [s]')
        if zoom_titles is not None:
            axes.set_title(zoom_titles[i])
    panels[0].set_ylabel('displacement [mm]')
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc='outside lower center', ncols=3)
    if title:
        figure.suptitle(style.fit(title, style.WIDTH, size=10))
    return figure


@style.styled
def band_at_zooms(
    record: Record,
    limits: Band,
    zooms: Sequence[Zoom],
    *,
    level: float = 0.95,
    total: Band | None = None,
    deterministic: Array | None = None,
    zoom_titles: Sequence[str] | None = None,
    title: str = '',
    band_name: str = 'GLUE band',
) -> Figure:
    """Draw bands over the measured displacement at zooms only, one row of panels.

    Below each panel the same relative to the median of the (total) band, so that a band much
    narrower than the motion is seen. Arguments and errors as `band_over_measured`.
    """
    _same_length(record, limits, total, deterministic)
    figure = style.new_figure(4.6)
    rows = figure.subplots(2, len(zooms), sharex='col', squeeze=False, height_ratios=(1.4, 1.0))
    time = record.time
    for i, (start, stop) in enumerate(zooms):
        upper, lower = rows[0, i], rows[1, i]
        _draw(upper, record, limits, level, total, deterministic, band_name)
        _zoom(upper, record, start, stop)
        part = slice(*np.searchsorted(time, (start, stop)))
        middle = (limits if total is None else total).median[part]
        low, high = (MM * (edge[part] - middle) for edge in limits.at(level))
        lower.fill_between(time[part], low, high, color=style.BAND, alpha=0.4, lw=0)
        if total is not None:
            low, high = (MM * (edge[part] - middle) for edge in total.at(level))
            lower.fill_between(time[part], low, high, **TOTAL_LOOK)
        if deterministic is not None:
            off = MM * (deterministic[part] - middle)
            lower.plot(time[part], off, '--', color=style.DETERMINISTIC)
        off = MM * (record.measured[part] - middle)
        lower.plot(time[part], off, color=style.MEASURED, lw=0.6)
        lower.set_xlabel('time [s]')
        if zoom_titles is not None:
            upper.set_title(zoom_titles[i])
    rows[0, 0].set_ylabel('displacement [mm]')
    rows[1, 0].set_ylabel('less median [mm]')
    handles, names = rows[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc='outside lower center', ncols=3)
    if title:
        figure.suptitle(style.fit(title, style.WIDTH, size=10))
    return figure


@style.styled
def parameters_against_time(
    time_s: Array,
    mean: Array,
    lower: Array,
    upper: Array,
    parameters: Sequence[Parameter],
    *,
    truth: Array | None = None,
    reference: Array | None = None,
    prior_dominated: Array | None = None,
    title: str = '',
    band_name: str = '95 % GLUE interval',
) -> Figure:
    """Draw each parameter's posterior mean and interval against time, one panel each.

    Args:
        time_s: time of each estimate, shape (w,) [s].
        mean: posterior means, shape (w, p), SI units.
        lower: lower limits, shape (w, p).
        upper: upper limits, shape (w, p).
        parameters: name and unit of each column, length p.
        truth: true values where known (simulated plant), shape (p,) or (w, p).
        reference: values to compare with, such as the deterministic ones, shape (p,).
        prior_dominated: parameters of which the data say little more than the prior, shape (p,);
            drawn in grey.
        title: title of the figure.
        band_name: what the interval is called in the legend.

    Raises:
        InputError: shapes that do not agree.
    """
    count = len(parameters)
    time_s, mean, lower, upper = (np.asarray(a, float) for a in (time_s, mean, lower, upper))
    if not mean.shape == lower.shape == upper.shape == (len(time_s), count):
        raise InputError(
            f'parameters against time: {len(time_s)} times and {count} parameters, but mean, '
            f'lower, upper have shapes {mean.shape}, {lower.shape}, {upper.shape}'
        )
    columns = 2 if count > 1 else 1
    rows = -(-count // columns)
    figure = style.new_figure(0.7 + 1.7 * rows)
    panels = figure.subplots(rows, columns, sharex=True, squeeze=False).ravel()
    for unused in panels[count:]:
        unused.set_visible(False)
    for i, (axes, parameter) in enumerate(zip(panels, parameters, strict=False)):
        dominated = prior_dominated is not None and bool(prior_dominated[i])
        colour = style.COMMAND if dominated else style.BAND
        exponent = style.engineering(mean[:, i], lower[:, i], upper[:, i])
        scale = 10.0**-exponent
        low, high = scale * lower[:, i], scale * upper[:, i]
        axes.fill_between(time_s, low, high, color=colour, alpha=0.3, lw=0, label=band_name)
        axes.plot(time_s, scale * mean[:, i], '-o', color=colour, label='posterior mean')
        if truth is not None:
            column = scale * np.broadcast_to(np.asarray(truth, float), mean.shape)[:, i]
            axes.plot(time_s, column, '--', color=style.TRUTH, label='true value')
        if reference is not None:
            at = scale * float(reference[i])
            axes.axhline(at, ls=':', color=style.DETERMINISTIC, label='deterministic')
        note = ', little more than the prior' if dominated else ''
        axes.set_title(style.label(parameter.name, parameter.unit, exponent) + note)
        axes.tick_params(labelbottom=i >= count - columns)
    for axes in panels[max(0, count - columns) : count]:
        axes.set_xlabel('time [s]')
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc='outside lower center', ncols=3)
    if title:
        figure.suptitle(style.fit(title, style.WIDTH, size=10))
    return figure


def _same_length(
    record: Record, limits: Band, total: Band | None, deterministic: Array | None
) -> None:
    for name, column in (('band', limits), ('total band', total), ('response', deterministic)):
        if column is not None and len(column) != len(record):
            raise InputError(f'the {name} has {len(column)} samples, the record has {len(record)}')


def _draw(
    axes: Axes,
    record: Record,
    limits: Band,
    level: float,
    total: Band | None,
    deterministic: Array | None,
    band_name: str,
) -> None:
    time = record.time
    percent = f'{100 * level:g} %'
    axes.plot(time, MM * record.command, ':', color=style.COMMAND, label='command')
    axes.plot(time, MM * record.measured, color=style.MEASURED, lw=0.9, label='measured')
    if deterministic is not None:
        axes.plot(time, MM * deterministic, '--', color=style.DETERMINISTIC, label='deterministic')
    lower, upper = limits.at(level)
    axes.fill_between(
        time, MM * lower, MM * upper, color=style.BAND, alpha=0.45, lw=0, zorder=3,
        label=f'{percent} {band_name}',
    )  # fmt: skip
    if total is not None:
        lower, upper = total.at(level)
        axes.fill_between(
            time, MM * lower, MM * upper, zorder=3, label=f'{percent} total predictive band',
            **TOTAL_LOOK,
        )  # fmt: skip


def _zoom(axes: Axes, record: Record, start: float, stop: float) -> None:
    # Data outside the view would set the scale: take it from what is seen.
    part = slice(*np.searchsorted(record.time, (start, stop)))
    seen = np.concatenate([record.command[part], record.measured[part]]) * MM
    pad = 0.12 * float(np.ptp(seen)) or 0.1
    axes.set(xlim=(start, stop), ylim=(float(seen.min()) - pad, float(seen.max()) + pad))
    axes.locator_params(axis='x', nbins=4)
