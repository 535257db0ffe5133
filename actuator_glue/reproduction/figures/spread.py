"""Table 4 as a figure: COV and skewness against the residual."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from actuator_glue.model.parameters import BASE
from actuator_glue.report import style
from actuator_glue.reproduction.published import TABLE_4
from actuator_glue.reproduction.spread import Spread

MM = 1e3


@style.styled
def against_residual(spread: Spread, sensor_rms: float) -> Figure:
    """Draw COV (top) and skewness (bottom) of each parameter against the residual's rms.

    Args:
        spread: the study.
        sensor_rms: residual at sensor-level noise [m], marked.
    """
    figure = style.new_figure(5.0)
    panels = figure.subplots(2, 4, sharex=True)
    rms = MM * spread.rms
    at = MM * spread.matched.best_rms
    ours = spread.matched.moments
    for i, parameter in enumerate(BASE):
        rows = (
            (spread.cov[:, i], TABLE_4.cov[i], ours.cov[i]),
            (spread.skewness[:, i], TABLE_4.skewness[i], ours.skewness[i]),
        )
        for axes, (values, published, matched) in zip(panels[:, i], rows, strict=True):
            axes.axvline(at, color=style.TRUTH, lw=0.9, label='best agreement')
            axes.axvline(
                MM * sensor_rms, color=style.COMMAND, lw=0.9, ls=':', label='sensor noise'
            )
            axes.axhline(published, color=style.PUBLISHED, lw=1.4, ls='--', label='Table 4')
            axes.plot(rms, values, '-o', color=style.BAND, ms=3, label='ours')
            axes.plot([at], [matched], 'D', color=style.TRUTH, ms=5, zorder=5)
            # The last points of heavy tails would squeeze what matters.
            top = max(2.2 * published, 1.25 * float(np.max(values[rms <= at + 0.02])))
            axes.set(ylim=(0, top), xlim=(0, 1.05 * rms[-1]))
            axes.set_xticks([0, 0.5, 1.0] if rms[-1] > 0.95 else [0, 0.4, 0.8])
        panels[0, i].set_title(style.SYMBOL[parameter.name], loc='center')
    panels[0, 0].set_ylabel('COV')
    panels[1, 0].set_ylabel('skewness')
    for axes in panels[1]:
        axes.set_xlabel('residual rms [mm]')
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc='outside lower center', ncols=4)
    return figure


@style.styled
def correlations(draws: np.ndarray) -> Figure:
    """Draw the matched posterior's draws (m, 4) pair by pair, scaled for reading."""
    scale = (1.0, 1e9, 1e5, 1.0)
    names = [
        r'$\beta_1$ [1/s]', r'$\alpha_1\beta_0$ [10$^9$]', r'$\alpha_2$ [10$^5$ N/m]',
        r'$\alpha_3$ [1/s]',
    ]  # fmt: skip
    figure = style.new_figure(4.6)
    panels = figure.subplots(3, 3, sharex='col', sharey='row')
    for row in range(3):
        for column in range(3):
            axes = panels[row, column]
            if column > row:
                axes.set_visible(False)
                continue
            x, y = draws[:, column] / scale[column], draws[:, row + 1] / scale[row + 1]
            axes.plot(x, y, '.', ms=2, alpha=0.35, color=style.BAND, rasterized=True)
            if row == 2:
                axes.set_xlabel(names[column])
            if column == 0:
                axes.set_ylabel(names[row + 1])
    figure.align_labels()
    return figure
