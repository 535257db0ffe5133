"""A prediction as a picture: command, median and 95 % bands, and what was measured."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from actuator_glue.motion import METRES
from actuator_glue.records import Array
from actuator_glue.report import style
from actuator_glue.report.timeseries import PARAMETER_LOOK, TOP, TOTAL_LOOK

_POINTS = 4000  # per line: more cannot be seen


class Predicted(NamedTuple):
    """Curves of a prediction, shape (n,) each: time [s], displacements and limits [m].

    `motion` is what they measure, as in a `Record`.
    """

    time: Array
    command: Array
    measured: Array | None
    median: Array
    total: tuple[Array, Array]
    parameter: tuple[Array, Array]
    motion: str = METRES


@style.styled
def prediction_figure(of: Predicted) -> Figure:
    """Draw the whole test, and below it bands and measurement less the median."""
    figure = style.new_figure(4.2, motion=of.motion)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1.0))
    some = slice(None, None, max(1, len(of.time) // _POINTS))
    t, median = of.time[some], of.median[some]
    upper.plot(t, 1e3 * of.command[some], ':', color=style.COMMAND, label='command')
    upper.plot(t, 1e3 * median, '--', color=style.DETERMINISTIC, label='median')
    for (low, high), text, look in (
        (of.parameter, '95 % band of the parameters', PARAMETER_LOOK),
        (of.total, '95 % band of a measurement', TOTAL_LOOK),
    ):
        upper.fill_between(t, 1e3 * low[some], 1e3 * high[some], label=text, **look)
        lower.fill_between(t, 1e6 * (low[some] - median), 1e6 * (high[some] - median), **look)
    if of.measured is not None:
        shown = of.measured[some]
        look = {'color': style.MEASURED, 'zorder': TOP}
        upper.plot(t, 1e3 * shown, lw=0.9, label='measured', **look)
        lower.plot(t, 1e6 * (shown - median), lw=0.5, **look)
    else:
        lower.plot(t, np.zeros_like(t), '--', color=style.DETERMINISTIC)
    upper.set_ylabel('displacement [mm]')
    lower.set_ylabel('less median [um]')
    lower.set_xlabel('time [s]')
    handles, names = upper.get_legend_handles_labels()
    figure.legend(handles, names, loc='outside lower center', ncols=3)
    return figure
