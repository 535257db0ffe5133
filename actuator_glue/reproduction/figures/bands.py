"""Figs. 7 to 11: bands and histograms of frequency response, bands of displacement."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator_glue.inference.bands import band
from actuator_glue.records import Array, Record
from actuator_glue.report import style
from actuator_glue.report.timeseries import band_at_zooms
from actuator_glue.reproduction.experiment import stiffness_name
from actuator_glue.reproduction.published import CLOSE_UPS
from actuator_glue.reproduction.responses import (
    GRID,
    LEVEL,
    Curves,
    FrequencyBands,
    TimeBands,
    decibel,
    phase,
    zooms,
)

DEGREES = 180.0 / np.pi


@style.styled
def frequency_response(
    bands: Mapping[str, Sequence[FrequencyBands]], curves: Sequence[Curves]
) -> Figure:
    """Draw Fig. 7: amplitude and phase bands of both tests under both posteriors.

    Args:
        bands: 'sensor' and 'matched', per test.
        curves: experiment and deterministic models, per test.
    """
    figure = style.new_figure(5.6)
    panels = figure.subplots(2, 2, sharex=True, sharey='row')
    for test, curve in enumerate(curves):
        wide, narrow = bands['matched'][test], bands['sensor'][test]
        rows = (
            (wide.amplitude, narrow.amplitude, decibel, 1.0),
            (wide.phase, narrow.phase, phase, DEGREES),
        )
        for row, (outer, inner, of, unit) in enumerate(rows):
            axes = panels[row, test]
            _shade(axes, unit * outer, style.LIGHT_BAND, 0.55, 'GLUE band, matched residual')
            _shade(axes, unit * inner, style.BAND, 1.0, 'GLUE band, sensor noise')
            axes.plot(GRID, unit * of(curve.experiment), color=style.MEASURED, label='experiment')
            axes.plot(
                GRID, unit * of(curve.table_2), '--', color=style.DETERMINISTIC, label='Table 2'
            )
        panels[0, test].set_title(f'({"ab"[test]}) amplitude, {stiffness_name(test)}')
        panels[1, test].set_title(f'({"cd"[test]}) phase, {stiffness_name(test)}')
        panels[1, test].set(xlabel='frequency [Hz]', xlim=(0, 10))
    panels[0, 0].set_ylabel('amplitude [dB]')
    panels[1, 0].set_ylabel('phase [deg]')
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc='outside lower center', ncols=4)
    return figure


def _shade(axes: Axes, draws: Array, colour: str, alpha: float, name: str) -> None:
    lower, upper = band(draws, [LEVEL]).at(LEVEL)
    axes.fill_between(GRID, lower, upper, color=colour, alpha=alpha, lw=0, label=name)


def displacement(
    record: Record, bands: TimeBands, total: TimeBands, deterministic: Array
) -> Figure:
    """Draw Fig. 8 or 9: bands over measured displacement near 1, 5 and 10 Hz.

    Args:
        record: the test.
        bands: GLUE band.
        total: total predictive band.
        deterministic: response with Table 2, shape (n,) [m].
    """
    return band_at_zooms(
        record, bands.limits, zooms(), level=LEVEL, total=total.limits,
        deterministic=deterministic, zoom_titles=[f'{f:g} Hz' for f in CLOSE_UPS],
        band_name='GLUE band, matched residual',
    )  # fmt: skip


@style.styled
def histograms(bands: FrequencyBands, curve: Curves) -> Figure:
    """Draw Fig. 10 or 11: distribution of amplitude and phase at 1, 5 and 10 Hz."""
    figure = style.new_figure(4.4)
    panels = figure.subplots(2, 3)
    rows = (
        (bands.close_amplitude, decibel, 1.0, 'amplitude [dB]'),
        (bands.close_phase, phase, DEGREES, 'phase [deg]'),
    )
    for row, (draws, of, unit, name) in enumerate(rows):
        for column, frequency in enumerate(CLOSE_UPS):
            axes = panels[row, column]
            axes.hist(
                unit * draws[:, column], bins=30, color=style.LIGHT_BAND, density=True,
                label='matched posterior',
            )  # fmt: skip
            experiment = unit * of(curve.close_experiment)[column]
            table_2 = unit * of(curve.close_table_2)[column]
            axes.axvline(experiment, color=style.MEASURED, lw=1.4, label='experiment')
            axes.axvline(table_2, color=style.DETERMINISTIC, lw=1.4, ls='--', label='Table 2')
            axes.set_title(f'({"abcdef"[3 * row + column]}) {frequency:g} Hz')
            axes.set(yticks=[], xlabel=name)
            axes.grid(axis='y', visible=False)
            axes.locator_params(axis='x', nbins=5)
        panels[row, 0].set_ylabel('density')
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc='outside lower center', ncols=3)
    return figure


@style.styled
def coverage_by_frequency(
    time: Mapping[str, Sequence[TimeBands]], names: Mapping[str, str]
) -> Figure:
    """Draw coverage of each 95 % band against frequency, both tests."""
    figure = style.new_figure(2.9)
    panels = figure.subplots(1, 2, sharey=True)
    looks = {
        'sensor': (style.BAND, 'o-'),
        'matched': (style.DETERMINISTIC, 's--'),
        'total': (style.TRUTH, '^-'),
    }
    for test, axes in enumerate(panels):
        for kind, (colour, look) in looks.items():
            parts = time[kind][test].scores[1:]
            middle = [0.5 * (s.low_hz + s.high_hz) for s in parts]
            inside = [100 * s.coverage for s in parts]
            axes.plot(middle, inside, look, color=colour, label=names[kind])
        axes.axhline(100 * LEVEL, color='black', lw=0.8, ls=(0, (6, 3)), label='nominal 95 %')
        axes.set(xlim=(0, 10), ylim=(0, 104), xlabel='frequency [Hz]', title=stiffness_name(test))
    panels[0].set_ylabel('samples inside [%]')
    figure.legend(*panels[0].get_legend_handles_labels(), loc='outside lower center', ncols=4)
    return figure
