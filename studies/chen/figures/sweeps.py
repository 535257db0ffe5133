"""Figs. 3 and 4: command against measured displacement."""

from __future__ import annotations

from matplotlib.figure import Figure

from actuator_glue.report import style
from studies.chen.experiment import zooms
from studies.chen.published import CLOSE_UPS
from studies.chen.study import Results

MM = 1e3


@style.styled
def command_and_measured(results: Results, test: int) -> Figure:
    """Draw a whole test and close-ups at 1, 5 and 10 Hz."""
    record = results.records[test]
    figure = style.new_figure(4.8)
    grid = figure.add_gridspec(2, 3)
    whole = figure.add_subplot(grid[0, :])
    panels = [figure.add_subplot(grid[1, i]) for i in range(3)]
    time, command, measured = record.time, MM * record.command, MM * record.measured
    whole.plot(time, command, color=style.COMMAND, lw=0.5, alpha=0.6)
    whole.plot(time, measured, color=style.BAND, lw=0.5)
    whole.set(xlim=(0, time[-1]), title='(a) whole test', xlabel='time [s]')
    whole.set_ylabel('displacement [mm]')
    for letter, axes, span, frequency in zip('bcd', panels, zooms(), CLOSE_UPS, strict=True):
        axes.plot(time, command, ':', color=style.COMMAND, lw=1.5, label='command')
        axes.plot(time, measured, color=style.BAND, label='measured')
        axes.set(xlim=span, ylim=(-2.35, 2.35), xlabel='time [s]')
        axes.set_title(f'({letter}) {frequency:g} Hz')
        axes.locator_params(axis='x', nbins=4)
    panels[0].set_ylabel('displacement [mm]')
    style.legend(figure, panels[0], columns=2)
    return figure
