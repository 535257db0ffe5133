"""Figures along time: bands over the measured displacement, parameters against time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import matplotlib.colors
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator_glue.errors import InputError
from actuator_glue.inference.bands import Band
from actuator_glue.model.parameters import Parameter
from actuator_glue.records import Array, Record
from actuator_glue.report import style
from actuator_glue.report.frequency import instantaneous_frequency

Zoom = tuple[float, float]
MM = 1e3
TOP = 5  # what was measured is seen over every band
PARAMETER_LOOK: dict[str, Any] = {'color': style.BAND, 'alpha': 0.45, 'lw': 0}
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


@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """Bands over a record of n samples, as they are drawn.

    Attributes:
        parameter: band of the parameters alone (GLUE) [m].
        total: total predictive band [m], drawn lighter.
        deterministic: response of one parameter set, shape (n,) [m].
        level: which level of the bands to draw.
        name: what the parameters' band is called in the legend.
    """

    parameter: Band
    total: Band | None = None
    deterministic: Array | None = None
    level: float = 0.95
    name: str = 'GLUE band'

    def check(self, count: int) -> None:
        """Refuse bands of another length than a record of `count` samples.

        Raises:
            InputError: the lengths differ.
        """
        columns = {'band': self.parameter, 'total band': self.total}
        for name, column in (columns | {'response': self.deterministic}).items():
            if column is not None and len(column) != count:
                raise InputError(f'the {name} has {len(column)} samples, the record has {count}')

    def part(self, part: slice) -> Bands:
        """Return the bands of some of the samples."""
        return replace(
            self,
            parameter=self.parameter.slice(part.start, part.stop),
            total=None if self.total is None else self.total.slice(part.start, part.stop),
            deterministic=None if self.deterministic is None else self.deterministic[part],
        )

    def draw(self, axes: Axes, time: Array, middle: Array | float, zorder: int) -> None:
        """Draw response and bands less `middle` [m] over time [s]."""
        if self.deterministic is not None:
            line = MM * (self.deterministic - middle)
            axes.plot(time, line, '--', color=style.DETERMINISTIC, label='deterministic')
        looks: list[tuple[Band | None, str, dict[str, Any]]] = [
            (self.parameter, self.name, PARAMETER_LOOK),
            (self.total, 'total predictive band', TOTAL_LOOK),
        ]
        for limits, name, look in looks:
            if limits is not None:
                lower, upper = (MM * (edge - middle) for edge in limits.at(self.level))
                label = f'{100 * self.level:g} % {name}'
                axes.fill_between(time, lower, upper, label=label, zorder=zorder, **look)


@style.styled
def band_at_zooms(
    record: Record,
    bands: Bands,
    zooms: Sequence[Zoom],
    *,
    zoom_titles: Sequence[str] | None = None,
    title: str = '',
) -> Figure:
    """Draw bands over the measured displacement at zooms, one row of panels.

    Below each panel the same relative to the median of the (total) band, so that a band much
    narrower than the motion is seen.

    Args:
        record: command and measured displacement.
        bands: what is drawn over it.
        zooms: time spans [s].
        zoom_titles: one title per zoom.
        title: title of the figure.

    Raises:
        InputError: a band or response of another length, or without this level.
    """
    bands.check(len(record))
    figure = style.new_figure(4.6, motion=record.motion)
    rows = figure.subplots(2, len(zooms), sharex='col', squeeze=False, height_ratios=(1.4, 1.0))
    time = record.time
    middle = (bands.parameter if bands.total is None else bands.total).median
    for i, (start, stop) in enumerate(zooms):
        upper, lower = rows[0, i], rows[1, i]
        upper.plot(time, MM * record.command, ':', color=style.COMMAND, label='command')
        upper.plot(
            time, MM * record.measured, color=style.MEASURED, lw=0.9, label='measured', zorder=TOP
        )
        bands.draw(upper, time, 0.0, 1)
        _zoom(upper, record, start, stop)
        part = slice(*np.searchsorted(time, (start, stop)))
        bands.part(part).draw(lower, time[part], middle[part], 1)
        off = MM * (record.measured[part] - middle[part])
        lower.plot(time[part], off, color=style.MEASURED, lw=0.6, zorder=TOP)
        lower.set_xlabel('time [s]')
        if zoom_titles is not None:
            upper.set_title(zoom_titles[i])
    rows[0, 0].set_ylabel('displacement [mm]')
    rows[1, 0].set_ylabel('less median [mm]')
    _caption(figure, rows[0, 0], title)
    return figure


@dataclass(frozen=True, slots=True, eq=False)
class ParameterCourse:
    """Posterior means and intervals of p parameters at w times, SI units.

    Attributes:
        time_s: time of each estimate, shape (w,) [s].
        mean: posterior means, shape (w, p).
        lower: lower limits, shape (w, p).
        upper: upper limits, shape (w, p).
        name: what the interval is called in the legend.
    """

    time_s: Array
    mean: Array
    lower: Array
    upper: Array
    name: str = '95 % GLUE interval'

    def check(self, count: int) -> None:
        """Refuse shapes that do not agree with one another and `count` parameters.

        Raises:
            InputError: they do not.
        """
        shapes = [a.shape for a in (self.mean, self.lower, self.upper)]
        if any(shape != (len(self.time_s), count) for shape in shapes):
            raise InputError(
                f'parameters against time: {len(self.time_s)} times and {count} parameters, but '
                f'mean, lower, upper have shapes {", ".join(map(str, shapes))}'
            )


@style.styled
def parameters_against_time(
    course: ParameterCourse,
    parameters: Sequence[Parameter],
    *,
    truth: Array | None = None,
    prior_dominated: Array | None = None,
    title: str = '',
) -> Figure:
    """Draw each parameter's posterior mean and interval against time, one panel each.

    Args:
        course: the posterior against time.
        parameters: name and unit of each column, length p.
        truth: true values where known (simulated plant), shape (p,) or (w, p).
        prior_dominated: parameters of which the data say little more than the prior, shape (p,);
            drawn in grey.
        title: title of the figure.

    Raises:
        InputError: shapes that do not agree.
    """
    count = len(parameters)
    course.check(count)
    time_s, mean, lower, upper = course.time_s, course.mean, course.lower, course.upper
    columns = min(count, 2)
    figure, panels = style.panels(count, columns, 1.7, 0.7, sharex=True)
    for i, (axes, parameter) in enumerate(zip(panels, parameters, strict=True)):
        dominated = prior_dominated is not None and bool(prior_dominated[i])
        colour = style.COMMAND if dominated else style.BAND
        exponent = style.engineering(mean[:, i], lower[:, i], upper[:, i])
        scale = 10.0**-exponent
        low, high = scale * lower[:, i], scale * upper[:, i]
        axes.fill_between(time_s, low, high, color=colour, alpha=0.3, lw=0, label=course.name)
        axes.plot(time_s, scale * mean[:, i], '-o', color=colour, label='posterior mean')
        if truth is not None:
            column = scale * np.broadcast_to(np.asarray(truth, float), mean.shape)[:, i]
            axes.plot(time_s, column, '--', color=style.TRUTH, label='true value')
        note = ', little more than the prior' if dominated else ''
        axes.set_title(style.label(parameter.name, parameter.unit, exponent) + note)
        axes.tick_params(labelbottom=i >= count - columns)
    for axes in panels[-columns:]:
        axes.set_xlabel('time [s]')
    _caption(figure, panels[0], title)
    return figure


def _caption(figure: Figure, axes: Axes, title: str) -> None:
    """Put the legend of a panel below all of them, and a title above."""
    style.legend(figure, axes)
    if title:
        figure.suptitle(style.fit(title, style.WIDTH, size=10))


def _zoom(axes: Axes, record: Record, start: float, stop: float) -> None:
    # Data outside the view would set the scale: take it from what is seen.
    part = slice(*np.searchsorted(record.time, (start, stop)))
    seen = np.concatenate([record.command[part], record.measured[part]]) * MM
    pad = 0.12 * float(np.ptp(seen)) or 0.1
    axes.set(xlim=(start, stop), ylim=(float(seen.min()) - pad, float(seen.max()) + pad))
    axes.locator_params(axis='x', nbins=4)
