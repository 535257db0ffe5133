"""Figures of a diagnosis: residual before and after, loop picture, ranking, posterior, bands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import signal

from actuator_glue.records import Array
from actuator_glue.report.style import (
    BAND,
    DETERMINISTIC,
    LIGHT_BAND,
    MEASURED,
    PUBLISHED,
    TOTAL,
    label,
    new_figure,
    styled,
)
from actuator_glue.residual.diagnosis import Diagnosis, Trace

BEFORE, AFTER = DETERMINISTIC, TOTAL
_POINTS = 4000  # per line: more cannot be seen


def _thin(trace: Trace, *columns: Array) -> tuple[Array, ...]:
    step = max(1, len(trace.time) // _POINTS)
    return tuple(column[::step] for column in columns)


def _name(trace: Trace) -> str:
    held = ', held out' if trace.held_out else ''
    return f'{Path(trace.source).name}: k = {trace.stiffness / 1e3:g} kN/m{held}'


@styled
def residuals_in_time(found: Diagnosis) -> Figure:
    """Residual of every record against time, before and after."""
    figure = new_figure(1.6 * len(found.traces) + 0.6)
    grid = figure.subplots(len(found.traces), 1, squeeze=False)[:, 0]
    for axes, trace in zip(grid, found.traces, strict=True):
        t, before, after = _thin(
            trace, trace.time, trace.measured - trace.before, trace.measured - trace.after
        )
        axes.plot(t, 1e6 * before, color=BEFORE, lw=0.6, label='before')
        axes.plot(t, 1e6 * after, color=AFTER, lw=0.6, label='after')
        axes.set_title(_name(trace), loc='left')
        axes.set_ylabel('residual [um]')
    grid[0].legend(loc='upper right', ncols=2)
    grid[-1].set_xlabel('time [s]')
    return figure


@styled
def residuals_in_frequency(found: Diagnosis) -> Figure:
    """Density of the residual of every record, before and after."""
    figure = new_figure(2.6)
    grid = figure.subplots(1, len(found.traces), squeeze=False, sharey=True)[0]
    for axes, trace in zip(grid, found.traces, strict=True):
        rate = 1.0 / float(np.median(np.diff(trace.time)))
        size = min(len(trace.time), int(4 * rate))
        for column, color, text in (
            (trace.before, BEFORE, 'before'),
            (trace.after, AFTER, 'after'),
        ):
            f, density = signal.welch(trace.measured - column, rate, nperseg=size)
            axes.loglog(f[1:], 1e6 * np.sqrt(density[1:]), color=color, lw=0.8, label=text)
        axes.set_title(_name(trace), loc='left', fontsize=7)
        axes.set_xlabel('frequency [Hz]')
    grid[0].set_ylabel(r'residual [um/$\sqrt{\mathrm{Hz}}$]')
    grid[0].legend()
    return figure


def _slow_part(trace: Trace) -> slice:
    """The part of a record with slow, large motion: loops show best there."""
    velocity = np.abs(np.gradient(trace.before, trace.time))
    length = max(50, len(velocity) // 10)
    means = np.convolve(velocity, np.ones(length) / length, mode='valid')
    spread = np.array(
        [np.ptp(trace.before[i : i + length]) for i in range(0, len(means), max(1, length // 4))]
    )
    starts = np.arange(0, len(means), max(1, length // 4))
    merit = np.where(spread > 0.5 * spread.max(), means[starts], np.inf)
    start = int(starts[int(np.argmin(merit))])
    return slice(start, start + length)


@styled
def loops(found: Diagnosis) -> Figure:
    """Residual against displacement (slow part) and against velocity, before and after."""
    figure = new_figure(2.3 * len(found.traces))
    grid = figure.subplots(len(found.traces), 2, squeeze=False)
    for (left, right), trace in zip(grid, found.traces, strict=True):
        part = _slow_part(trace)
        smooth = max(1, round(0.02 / float(np.median(np.diff(trace.time)))))
        weights = np.ones(smooth) / smooth
        velocity: Array = np.asarray(np.gradient(trace.after, trace.time), dtype=np.float64)
        for column, color, text in (
            (trace.before, BEFORE, 'before'),
            (trace.after, AFTER, 'after'),
        ):
            residual: Array = np.convolve(trace.measured - column, weights, mode='same').astype(
                np.float64
            )
            left.plot(1e3 * column[part], 1e6 * residual[part], color=color, lw=0.6, label=text)
            v, r = _thin(trace, velocity, residual)
            right.plot(1e3 * v, 1e6 * r, '.', ms=0.8, color=color, label=text)
        left.set_title(_name(trace), loc='left')
        left.set_xlabel('displacement [mm] (slow part)')
        left.set_ylabel('residual [um]')
        right.set_xlabel('velocity [mm/s]')
    grid[0, 1].legend(loc='upper left', markerscale=8)
    return figure


@styled
def ranking(found: Diagnosis) -> Figure:
    """Error that each single candidate leaves on the fitting part."""
    shown = found.candidates[:14][::-1]
    figure = new_figure(0.22 * len(shown) + 0.8)
    axes: Axes = figure.subplots()
    named = {n for e in found.effects for n in (e.name, *e.alternatives)}
    colors = [AFTER if c.name in named else LIGHT_BAND for c in shown]
    axes.barh([c.name for c in shown], [1e6 * c.error for c in shown], color=colors)
    axes.axvline(1e6 * found.alarm.noise, color=MEASURED, ls='--', lw=0.8, label='noise')
    axes.set_xlabel('rms error of Eq. (2) + one effect, refitted [um]')
    axes.legend(loc='lower right')
    return figure


@styled
def posteriors(found: Diagnosis) -> Figure:
    """Marginal posterior of every effect parameter, with its neutral value."""
    columns = found.names[4:]
    figure = new_figure(2.0)
    grid = figure.subplots(1, len(columns), squeeze=False)[0]
    estimates = {n: p for e in found.effects for n, p in e.parameters.items()}
    for axes, name, draws in zip(grid, columns, found.posterior.T[4:], strict=True):
        axes.hist(draws, bins=40, color=BAND, density=True)
        estimate = estimates.get(name)
        axes.set_xlabel(label(name, estimate.unit if estimate else ''))
        axes.set_yticks([])
    return figure


@styled
def bands(found: Diagnosis) -> Figure:
    """95 % bands before and after on one second of the held-out part where they differ most."""
    trace = next(t for t in found.traces if t.held_out)
    period = float(np.median(np.diff(trace.time)))
    length = max(10, round(1.0 / period))
    change = (trace.before - trace.after) ** 2
    start = int(np.argmax(np.convolve(change, np.ones(length), mode='valid')))
    part = slice(start, start + length)
    figure = new_figure(2.8)
    grid = figure.subplots(1, 2, sharey=True)
    sides = (
        ('before', trace.lower_before, trace.upper_before, PUBLISHED),
        ('after', trace.lower_after, trace.upper_after, LIGHT_BAND),
    )
    for axes, (text, lower, upper, color), share in zip(grid, sides, found.coverage, strict=True):
        t = trace.time[part]
        axes.fill_between(t, 1e3 * lower[part], 1e3 * upper[part], color=color, label='95 % band')
        axes.plot(t, 1e3 * trace.measured[part], color=MEASURED, lw=0.7, label='measured')
        axes.set_title(f'{text}: {100 * share:.1f} % inside', loc='left')
        axes.set_xlabel('time [s]')
    grid[0].set_ylabel('displacement [mm]')
    grid[0].legend()
    return figure
