"""Figures of a diagnosis: residual before and after, loop picture, ranking, posterior, bands."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator_glue.diagnosis.telling.headline import names_of
from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.diagnosis.verdict.traces import Trace
from actuator_glue.records import Array
from actuator_glue.report import style
from actuator_glue.report.quantity import said_in
from actuator_glue.report.style import (
    BAND,
    DETERMINISTIC,
    LIGHT_BAND,
    MEASURED,
    NOISE,
    POINTS,
    PUBLISHED,
    TOTAL,
    legend,
    new_figure,
    panels,
    styled,
)
from actuator_glue.report.worst import worst

BEFORE, AFTER = DETERMINISTIC, TOTAL
_SECONDS = 4.0  # of each periodogram that is averaged
_SMOOTH = 0.02  # s, so that loops are seen through the noise


def moved(found: DiagnosisData) -> bool:
    """Whether an effect was added that changes the simulated motion; others add to the noise."""
    return any(e.noise is None for e in found.effects)


def _sides(found: DiagnosisData) -> list[tuple[str, str]]:
    """Return field of a `Trace` and colour of what is drawn: one where nothing was added."""
    return [('before', BEFORE), ('after', AFTER)][: 2 if moved(found) else 1]


def _text(found: DiagnosisData, side: str) -> str:
    return side if moved(found) else 'Eq. (2), refitted'


def _title(called: Mapping[str, str], trace: Trace, width: float) -> str:
    tail = f': k = {trace.stiffness / 1e3:g} kN/m{", held out" if trace.held_out else ""}'
    return style.fit(called[trace.source], width, tail=tail)


def _lines(trace: Trace, *columns: Array) -> Array:
    """Return columns as lines to draw: not too many points, and broken at the gaps."""
    step = max(1, len(trace.time) // POINTS)
    table = np.column_stack(columns)
    gap = np.full((1, len(columns)), np.nan)
    parts = [piece for part in trace.stretches() for piece in (table[part][::step], gap)]
    return np.vstack(parts).T


@styled
def residual_summary(found: DiagnosisData, *, narrow: bool = False) -> Figure:
    """Residual where both models differ most, before and after, with the noise; rms errors.

    Both of held-out data; one below the other where it is `narrow`, for a phone.
    """
    trace = next(t for t in found.traces if t.held_out)
    part, error = _differing(trace, _SECONDS), found.error
    if narrow:
        figure, room = new_figure(4.6, style.NARROW), style.NARROW
        left, right = figure.subplots(2, 1, height_ratios=(1.4, 1.0))
    else:
        figure, room = new_figure(2.9), 0.7 * style.WIDTH
        left, right = figure.subplots(1, 2, width_ratios=(2.6, 1.0))
    floor = 2e6 * error.noise_floor
    left.axhspan(-floor, floor, color=NOISE, lw=0, label='noise (2 standard deviations)')
    for side, color in _sides(found):
        residual = 1e6 * (trace.measured[part] - getattr(trace, side)[part])
        left.plot(trace.time[part], residual, color=color, lw=0.7, label=_text(found, side))
    left.set_xlabel('time [s]')
    left.set_ylabel('measured less model [um]')
    left.set_title(_title(names_of(found), trace, room - 0.7))
    bars = [
        (_text(found, side), getattr(error, side), getattr(error, f'{side}_ci'), color)
        for side, color in _sides(found)
    ]
    for at, (_, rms, (low, high), color) in enumerate(bars):
        right.bar(at, 1e6 * rms, color=color, width=0.6)
        if np.isfinite([low, high]).all():
            right.plot([at, at], [1e6 * low, 1e6 * high], color=MEASURED, lw=1.2)
        right.annotate(
            f'{1e6 * rms:.1f}',
            (at, 1e6 * np.nanmax([rms, high])),
            (0, 2),
            ha='center',
            va='bottom',
            textcoords='offset points',
        )
    right.axhline(1e6 * error.noise_floor, color=MEASURED, ls='--', lw=0.9, label='noise (rms)')
    right.set_xticks(range(len(bars)), [name.replace(', ', ',\n') for name, *_ in bars])
    right.set_xlim(-0.6, len(bars) - 0.4)
    right.margins(y=0.15)
    right.set_ylabel('rms error [um]')
    right.set_title('all held-out data')
    legend(figure, left, right, columns=2)
    return figure


def _left(trace: Trace) -> float:
    """Return the rms of what the final model leaves of a record [m]."""
    return float(np.sqrt(np.mean((trace.measured - trace.after) ** 2)))


@styled
def residuals_in_time(found: DiagnosisData) -> Figure:
    """Residual of the worst records against time, before and after."""
    called, traces = names_of(found), worst(found.traces, _left)
    figure = new_figure(1.6 * len(traces) + 0.8)
    grid = figure.subplots(len(traces), 1, squeeze=False)[:, 0]
    for axes, trace in zip(grid, traces, strict=True):
        for side, color in _sides(found):
            t, residual = _lines(trace, trace.time, trace.measured - getattr(trace, side))
            axes.plot(t, 1e6 * residual, color=color, lw=0.6, label=_text(found, side))
        axes.set_title(_title(called, trace, style.WIDTH - 0.7))
        axes.set_ylabel('residual [um]')
    grid[-1].set_xlabel('time [s]')
    legend(figure, grid[0])
    return figure


def _density(trace: Trace, residual: Array) -> tuple[Array, Array]:
    """Return frequencies [Hz] and the amplitude density of a residual, its gaps left out."""
    rate = 1.0 / float(np.median(np.diff(trace.time)))
    parts = trace.stretches()
    size = min(max(p.stop - p.start for p in parts), round(_SECONDS * rate))
    used = [p for p in parts if p.stop - p.start >= size]
    found = [scipy.signal.welch(residual[p], rate, nperseg=size) for p in used]
    power = np.average([f[1] for f in found], axis=0, weights=[p.stop - p.start for p in used])
    return found[0][0][1:], np.sqrt(power[1:])


@styled
def residuals_in_frequency(found: DiagnosisData) -> Figure:
    """Density of the residual of the worst records, before and after."""
    called, traces = names_of(found), worst(found.traces, _left)
    columns = min(len(traces), 2)
    figure, grid = panels(len(traces), columns, 2.1, 0.6, sharey=True)
    for axes, trace in zip(grid, traces, strict=True):
        for side, color in _sides(found):
            f, density = _density(trace, trace.measured - getattr(trace, side))
            axes.loglog(f, 1e6 * density, color=color, lw=0.8, label=_text(found, side))
        axes.set_title(_title(called, trace, style.WIDTH / columns - 0.5))
        axes.set_xlabel('frequency [Hz]')
        style.decades(axes.xaxis)
        style.decades(axes.yaxis)
    for axes in grid[::columns]:
        axes.set_ylabel(r'residual [um/$\sqrt{\mathrm{Hz}}$]')
    legend(figure, grid[0])
    return figure


def _slow_part(trace: Trace) -> slice:
    """Return a part of a record with slow, large motion: loops show best there."""
    parts = trace.stretches()
    longest = max(p.stop - p.start for p in parts)
    length = min(max(50, len(trace.time) // 10), longest)
    windows = [
        slice(start, start + length)
        for part in parts
        for start in range(part.start, part.stop - length + 1, max(1, length // 4))
    ]
    spread = np.array([np.ptp(trace.before[w]) for w in windows])
    speed = np.array([np.abs(np.diff(trace.before[w])).mean() for w in windows])
    return windows[int(np.argmin(np.where(spread >= 0.5 * spread.max(), speed, np.inf)))]


def _smooth(trace: Trace, values: Array) -> Array:
    """Return a moving mean of `_SMOOTH` seconds, within each stretch."""
    size = max(1, round(_SMOOTH / float(np.median(np.diff(trace.time)))))
    weights = np.ones(size)
    means = []
    for part in trace.stretches():
        count = np.convolve(np.ones(part.stop - part.start), weights, mode='same')
        means.append(np.convolve(values[part], weights, mode='same')[: len(count)] / count)
    return np.concatenate(means)


@styled
def loops(found: DiagnosisData) -> Figure:
    """Residual against displacement (slow part) and against velocity, before and after."""
    called, traces = names_of(found), worst(found.traces, _left)
    figure = new_figure(2.1 * len(traces) + 0.4)
    grid = figure.subplots(len(traces), 2, squeeze=False)
    for (left, right), trace in zip(grid, traces, strict=True):
        part, step = _slow_part(trace), max(1, len(trace.time) // POINTS)
        for side, color in _sides(found):
            simulated: Array = getattr(trace, side)
            residual = 1e6 * _smooth(trace, trace.measured - simulated)
            velocity = np.gradient(simulated, trace.time)
            left.plot(1e3 * simulated[part], residual[part], color=color, lw=0.6)
            right.plot(
                1e3 * velocity[::step],
                residual[::step],
                '.',
                ms=0.8,
                color=color,
                label=_text(found, side),
            )
        left.set_title(_title(called, trace, style.WIDTH - 0.7))
        left.set_xlabel('displacement [mm] (slow part)')
        left.set_ylabel('residual [um]')
        right.set_xlabel('velocity [mm/s]')
        # The title of a row is as long as both panels.
        left.title.set_in_layout(False)
    legend(figure, grid[0, 1], scale=8)
    return figure


@styled
def ranking(found: DiagnosisData) -> Figure:
    """Error that each single candidate leaves on the fitting part."""
    shown = found.candidates[:14][::-1]
    figure = new_figure(0.22 * len(shown) + 1.0)
    axes: Axes = figure.subplots()
    named = {n for e in found.effects for n in (e.name, *e.alternatives)}
    colors = [AFTER if c.name in named else LIGHT_BAND for c in shown]
    axes.barh([c.name for c in shown], [1e6 * c.error for c in shown], color=colors)
    axes.axvline(1e6 * found.alarm.noise, color=MEASURED, ls='--', lw=0.8, label='noise')
    axes.set_xlabel('rms error of Eq. (2) + one effect, refitted [um]')
    legend(figure, axes)
    return figure


@styled
def posteriors(found: DiagnosisData) -> Figure:
    """Marginal posterior of every effect parameter."""
    estimates = {n: p for e in found.effects for n, p in e.parameters.items()}
    names = found.names[4:]
    figure, grid = panels(len(names), min(len(names), 3), 1.7, 0.3)
    for axes, name, draws in zip(grid, names, found.posterior.T[4:], strict=True):
        unit = estimates[name].unit if name in estimates else ''
        factor, unit = said_in(unit, draws)
        exponent = style.engineering(factor * draws)
        axes.hist(factor * draws / 10.0**exponent, bins=40, color=BAND, density=True)
        axes.set_xlabel(style.label(name, unit or '-', exponent))
        axes.set_yticks([])
        axes.locator_params(axis='x', nbins=4)
    return figure


@styled
def bands(found: DiagnosisData) -> Figure:
    """95 % bands on one second of the held-out part where before and after differ most.

    The lower panels show the same less the middle of the band.
    """
    trace = next(t for t in found.traces if t.held_out)
    part = _differing(trace, 1.0)
    t, measured = trace.time[part], trace.measured[part]
    figure = new_figure(4.2)
    looks = {'before': PUBLISHED, 'after': LIGHT_BAND}
    sides = _sides(found)
    grid = figure.subplots(2, len(sides), squeeze=False, sharex=True, sharey='row')
    for (upper, lower), (side, _), share in zip(grid.T, sides, found.coverage, strict=False):
        low, high = (getattr(trace, f'{edge}_{side}')[part] for edge in ('lower', 'upper'))
        middle = getattr(trace, side)[part]
        for axes, scale, less in ((upper, 1e3, 0.0 * middle), (lower, 1e6, middle)):
            axes.fill_between(
                t,
                scale * (low - less),
                scale * (high - less),
                color=looks[side],
                label=f'95 % band, {_text(found, side)}',
            )
            axes.plot(t, scale * (measured - less), color=MEASURED, lw=0.7, label='measured')
        upper.set_title(f'{_text(found, side)}: {100 * share:.1f} % inside')
        lower.set_xlabel('time [s]')
    grid[0, 0].set_ylabel('displacement [mm]')
    grid[1, 0].set_ylabel('less the middle\nof the band [um]')
    legend(figure, *grid[0])
    return figure


def _differing(trace: Trace, seconds: float) -> slice:
    """Return the stretch of a duration, without a gap, in which both models differ most."""
    wanted = max(10, round(seconds / float(np.median(np.diff(trace.time)))))
    parts = trace.stretches()
    length = min(wanted, max(p.stop - p.start for p in parts))
    total = np.cumsum(np.append(0.0, (trace.before - trace.after) ** 2))
    starts = [np.arange(p.start, p.stop - length + 1) for p in parts]
    every = np.concatenate(starts)
    start = int(every[np.argmax(total[every + length] - total[every])])
    return slice(start, start + length)
