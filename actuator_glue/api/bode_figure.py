"""Frequency responses as Bode plots: gain, phase and delay with 95 % bands, measured on top."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from actuator_glue.api.frequency_response import FrequencyResponse
from actuator_glue.report import style
from actuator_glue.report.timeseries import TOP


@style.styled
def bode_figure(responses: Sequence[tuple[str, FrequencyResponse]]) -> Figure:
    """Draw responses side by side, each under its title."""
    count = len(responses)
    figure = style.new_figure(5.4)
    grid = figure.subplots(3, count, sharex='col', sharey='row', squeeze=False)
    for column, (title, of) in zip(grid.T, responses, strict=True):
        scaled = (of.gain, of.phase, tuple(1e3 * edge for edge in of.delay))
        for axes, (median, lower, upper) in zip(column, scaled, strict=True):
            axes.fill_between(
                of.frequency, lower, upper, color=style.BAND, alpha=0.45, lw=0, label='95 % band'
            )
            axes.semilogx(
                of.frequency, median, '--', color=style.DETERMINISTIC, label='median of the draws'
            )
        if of.measured is not None:
            hertz, gain, phase = of.measured
            seen = (gain, phase, -1e3 * phase / (360.0 * hertz))
            for axes, values in zip(column, seen, strict=True):
                axes.semilogx(
                    hertz,
                    values,
                    '.-',
                    color=style.MEASURED,
                    lw=0.6,
                    ms=2.5,
                    zorder=TOP,
                    label='measured',
                )
        column[0].set_title(style.fit(title, style.WIDTH / count - 0.5))
        column[-1].set_xlabel('frequency [Hz]')
        style.decades(column[-1].xaxis)
        low, high = of.frequency[[0, -1]]
        if high > low:
            column[-1].set_xlim(low, high)
    for axes, text in zip(grid[:, 0], ('gain [-]', 'phase [degrees]', 'delay [ms]'), strict=True):
        axes.set_ylabel(text)
    style.legend(figure, *grid[0])
    return figure
