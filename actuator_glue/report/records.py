"""A record as it is: command, displacement, their difference and the force."""

from __future__ import annotations

from matplotlib.figure import Figure

from actuator_glue.records import Record
from actuator_glue.report import style
from actuator_glue.report.timeseries import even_zooms

MM = 1e3


@style.styled
def record_figure(record: Record) -> Figure:
    """Draw one record: the whole of it, three zooms of a few cycles, tracking error and force.

    The tracking error is command less measured: what the actuator lags behind, not a model error.
    """
    rows = 3 if record.force is None else 4
    figure = style.new_figure(1.6 + 1.7 * rows, motion=record.motion)
    grid = figure.add_gridspec(rows, 3, height_ratios=(1.0, 1.4, *([0.8] * (rows - 2))))
    time = record.time
    whole = figure.add_subplot(grid[0, :])
    whole.plot(time, MM * record.command, color=style.COMMAND, lw=0.5, label='command')
    whole.plot(time, MM * record.measured, color=style.MEASURED, lw=0.5, label='measured')
    whole.set_ylabel('displacement [mm]')
    for i, (start, stop) in enumerate(even_zooms(record)):
        axes = figure.add_subplot(grid[1, i])
        part = slice(max(round(start * record.rate), 0), max(round(stop * record.rate), 2))
        axes.plot(time[part], MM * record.command[part], ':', color=style.COMMAND)
        axes.plot(time[part], MM * record.measured[part], color=style.MEASURED)
        axes.margins(x=0)
        axes.locator_params(axis='x', nbins=3)
        if i == 0:
            axes.set_ylabel('displacement [mm]')
    error = figure.add_subplot(grid[2, :], sharex=whole)
    error.plot(time, MM * (record.command - record.measured), color=style.DETERMINISTIC, lw=0.5)
    error.set_ylabel('tracking\nerror [mm]')
    if record.force is not None:
        force = figure.add_subplot(grid[3, :], sharex=whole)
        force.plot(time, 1e-3 * record.force, color=style.BAND, lw=0.5)
        force.set_ylabel('force [kN]')
    whole.set_xlim(0.0, record.duration)
    for axes in figure.axes:
        axes.set_xlabel('time [s]')
    style.legend(figure, whole, columns=2)
    k = record.stiffness
    stiffness = 'not known' if k is None else f'{k / 1e3:.6g} kN/m'
    told = f': {len(record)} samples at {record.rate:.6g} Hz, specimen stiffness {stiffness}'
    figure.suptitle(style.fit(record.actuator, style.WIDTH, tail=told, size=10))
    return figure
