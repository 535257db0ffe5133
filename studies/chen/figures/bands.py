"""Figs. 7 to 11: bands and histograms of frequency response, bands of displacement."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from actuator_glue.report import style
from actuator_glue.report.timeseries import Bands, band_at_zooms
from studies.chen.experiment import stiffness_name, zooms
from studies.chen.figures.look import REFERENCE
from studies.chen.library import TABLE_2
from studies.chen.published import CLOSE_UPS
from studies.chen.responses import CLOSE, GRID, LEVEL, QUANTITIES, quantity, simulate
from studies.chen.study import Results
from studies.chen.words import BANDS

UNITS = {'amplitude': (1.0, 'dB'), 'phase': (180.0 / np.pi, 'deg')}


@style.styled
def frequency_response(results: Results) -> Figure:
    """Draw Fig. 7: amplitude and phase bands of both tests under both posteriors."""
    figure = style.new_figure(5.6)
    panels = figure.subplots(2, 2, sharex=True, sharey='row')
    looks = (('matched', style.LIGHT_BAND, 0.55), ('sensor', style.BAND, 1.0))
    for row, name in enumerate(QUANTITIES):
        unit, symbol = UNITS[name]
        for test, curves in enumerate(results.curves):
            axes = panels[row, test]
            for kind, colour, alpha in looks:
                lower, upper = results.frequency[kind][test][name].limits.at(LEVEL)
                axes.fill_between(
                    GRID,
                    unit * lower,
                    unit * upper,
                    color=colour,
                    alpha=alpha,
                    lw=0,
                    label=BANDS[kind],
                )
            measured, table_2 = (
                unit * quantity(name, curves[k]) for k in ('experiment', 'Table 2')
            )
            axes.plot(GRID, measured, color=style.MEASURED, label='experiment')
            axes.plot(GRID, table_2, '--', color=style.DETERMINISTIC, label='Table 2')
            axes.set_title(f'({"abcd"[2 * row + test]}) {name}, {stiffness_name(test)}')
        panels[row, 0].set_ylabel(f'{name} [{symbol}]')
    for axes in panels[1]:
        axes.set(xlabel='frequency [Hz]', xlim=(0, 10))
    style.legend(figure, panels[0, 0], columns=4)
    return figure


def displacement(results: Results, test: int) -> Figure:
    """Draw Fig. 8 or 9: bands over measured displacement near 1, 5 and 10 Hz."""
    record = results.records[test]
    shown = Bands(
        results.time['matched'][test].limits,
        results.time['total'][test].limits,
        simulate(TABLE_2[None], record)[0],
        LEVEL,
        'GLUE band, matched residual',
    )
    return band_at_zooms(record, shown, zooms(), zoom_titles=[f'{f:g} Hz' for f in CLOSE_UPS])


@style.styled
def histograms(results: Results, test: int) -> Figure:
    """Draw Fig. 10 or 11: distribution of amplitude and phase at 1, 5 and 10 Hz."""
    figure = style.new_figure(4.4)
    panels = figure.subplots(2, 3)
    for row, name in enumerate(QUANTITIES):
        unit, symbol = UNITS[name]
        draws = results.frequency['matched'][test][name].draws
        for column, (frequency, at) in enumerate(zip(CLOSE_UPS, CLOSE, strict=True)):
            axes = panels[row, column]
            axes.hist(
                unit * draws[:, at],
                bins=30,
                color=style.LIGHT_BAND,
                density=True,
                label='matched posterior',
            )
            measured, table_2 = (
                unit * quantity(name, results.curves[test][k])[at]
                for k in ('experiment', 'Table 2')
            )
            axes.axvline(measured, color=style.MEASURED, lw=1.4, label='experiment')
            axes.axvline(table_2, color=style.DETERMINISTIC, lw=1.4, ls='--', label='Table 2')
            axes.set_title(f'({"abcdef"[3 * row + column]}) {frequency:g} Hz')
            axes.set(yticks=[], xlabel=f'{name} [{symbol}]')
            axes.grid(axis='y', visible=False)
            axes.locator_params(axis='x', nbins=5)
        panels[row, 0].set_ylabel('density')
    style.legend(figure, panels[0, 0], columns=3)
    return figure


@style.styled
def coverage_by_frequency(results: Results) -> Figure:
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
            parts = results.time[kind][test].scores[1:]
            middle = [0.5 * (s.low_hz + s.high_hz) for s in parts]
            inside = [100 * s.coverage for s in parts]
            axes.plot(middle, inside, look, color=colour, label=BANDS[kind])
        axes.axhline(100 * LEVEL, color='black', lw=0.8, ls=REFERENCE, label='nominal 95 %')
        axes.set(xlim=(0, 10), ylim=(0, 104), xlabel='frequency [Hz]', title=stiffness_name(test))
    panels[0].set_ylabel('samples inside [%]')
    style.legend(figure, panels[0], columns=4)
    return figure
