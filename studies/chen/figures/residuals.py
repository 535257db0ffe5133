"""Posteriors against the residual's size, and the residual of the tests against frequency."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from actuator_glue.report import style
from actuator_glue.report.posterior_figure import posterior_figure
from studies.chen import misfit
from studies.chen.experiment import stiffness_name
from studies.chen.figures.look import REFERENCE
from studies.chen.library import BASE, NOISE
from studies.chen.published import TABLE_4
from studies.chen.study import Results

MM, UM = 1e3, 1e6


@style.styled
def spread(results: Results) -> Figure:
    """Draw COV (top) and skewness (bottom) of each parameter against the residual's rms."""
    found = results.table_4
    figure = style.new_figure(5.0)
    panels = figure.subplots(2, 4, sharex=True)
    rms = MM * np.array([p.best_rms for p in found.posteriors])
    at = MM * found.matched.best_rms
    for row, moment in enumerate(('cov', 'skewness')):
        for i, parameter in enumerate(BASE):
            axes = panels[row, i]
            values = np.array([getattr(p.moments, moment)[i] for p in found.posteriors])
            published = TABLE_4[moment][i]
            matched = getattr(found.matched.moments, moment)[i]
            axes.axvline(at, color=style.TRUTH, lw=0.9, label='best agreement')
            axes.axvline(
                MM * results.sensor.best_rms,
                color=style.COMMAND,
                lw=0.9,
                ls=':',
                label='sensor noise',
            )
            axes.axhline(published, color=style.PUBLISHED, lw=1.4, ls='--', label='Table 4')
            axes.plot(rms, values, '-o', color=style.BAND, ms=3, label='ours')
            axes.plot([at], [matched], 'D', color=style.TRUTH, ms=5, zorder=5)
            # The last points of heavy tails would squeeze what matters.
            top = max(2.2 * published, 1.25 * float(np.max(values[rms <= at + 0.02])))
            axes.set(ylim=(0, top), xlim=(0, 1.05 * rms[-1]))
            axes.set_xticks([0, 0.5, 1.0] if rms[-1] > 0.95 else [0, 0.4, 0.8])
            if row == 0:
                axes.set_title(style.SYMBOL[parameter.name], loc='center')
            else:
                axes.set_xlabel('residual rms [mm]')
    panels[0, 0].set_ylabel('COV')
    panels[1, 0].set_ylabel('skewness')
    style.legend(figure, panels[0, 0], columns=4)
    return figure


def matched_posterior(results: Results) -> Figure:
    """Draw the matched posterior, each parameter and each pair."""
    draws = results.table_4.matched.thinned(20_000)
    return posterior_figure(draws, [p.name for p in BASE], [p.unit for p in BASE])


@style.styled
def by_frequency(results: Results) -> Figure:
    """Draw the residual's rms against frequency, both tests, for refits to both tests."""
    figure = style.new_figure(3.1)
    panels = figure.subplots(1, 2, sharey=True)
    looks = [(style.BAND, 'o-'), (style.DETERMINISTIC, 's--'), (style.TRUTH, '^-.')]
    both = [r for r in results.refits.values() if len(r.residual) == 2]
    top = 0.0
    for test, axes in enumerate(panels):
        for refit, (colour, look) in zip(both, looks, strict=True):
            centres, rms = misfit.by_frequency(results.records[test], refit.residual[test])
            name = refit.name.removesuffix(', both tests')
            axes.plot(centres, UM * rms, look, color=colour, label=name)
            top = max(top, 1.05 * UM * float(rms.max()))
        axes.axhline(UM * NOISE, color='black', lw=0.8, ls=REFERENCE, label='sensor noise')
        axes.set(xlabel='frequency [Hz]', xlim=(0, 10), title=stiffness_name(test))
    panels[0].set(ylim=(0, top), ylabel='residual rms [µm]')
    style.legend(figure, panels[0], columns=2)
    return figure
