"""A prediction as a picture: command, median and 95 % bands, and what was measured."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from actuator_glue.motion import METRES
from actuator_glue.records import Array
from actuator_glue.report import style
from actuator_glue.report.timeseries import PARAMETER_LOOK, TOP, TOTAL_LOOK


@style.styled
def prediction_figure(
    time: Array,
    command: Array,
    median: Array,
    total: tuple[Array, Array],
    parameter: tuple[Array, Array],
    measured: Array | None = None,
    motion: str = METRES,
) -> Figure:
    """Draw the whole test, and below it bands and measurement less the median.

    Args:
        time: of the samples, shape (n,) [s].
        command: shape (n,) [m].
        median: of what is expected, shape (n,) [m].
        total: limits of what will be measured, shape (n,) each [m].
        parameter: limits by the parameters alone, shape (n,) each [m].
        measured: shape (n,) [m]; None where nothing was.
        motion: what is measured, as in a `Record`.
    """
    figure = style.new_figure(4.2, motion=motion)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1.0))
    some = slice(None, None, max(1, len(time) // style.POINTS))
    t, middle = time[some], median[some]
    upper.plot(t, 1e3 * command[some], ':', color=style.COMMAND, label='command')
    upper.plot(t, 1e3 * middle, '--', color=style.DETERMINISTIC, label='median')
    for (low, high), text, look in (
        (parameter, '95 % band of the parameters', PARAMETER_LOOK),
        (total, '95 % band of a measurement', TOTAL_LOOK),
    ):
        upper.fill_between(t, 1e3 * low[some], 1e3 * high[some], label=text, **look)
        lower.fill_between(t, 1e6 * (low[some] - middle), 1e6 * (high[some] - middle), **look)
    if measured is not None:
        shown = measured[some]
        look = {'color': style.MEASURED, 'zorder': TOP}
        upper.plot(t, 1e3 * shown, lw=0.9, label='measured', **look)
        lower.plot(t, 1e6 * (shown - middle), lw=0.5, **look)
    else:
        lower.plot(t, np.zeros_like(t), '--', color=style.DETERMINISTIC)
    upper.set_ylabel('displacement [mm]')
    lower.set_ylabel('less median [um]')
    lower.set_xlabel('time [s]')
    style.legend(figure, upper)
    return figure
