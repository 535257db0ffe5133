"""Figs. 5 and 6, and what G does to the posterior's spread and to its bands."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from actuator_glue.report import style
from studies.chen.convergence import evaluations_at
from studies.chen.figures.look import (
    COLOURS,
    DASHES,
    MARKS,
    REFERENCE,
    shaping_title,
)
from studies.chen.library import BASE
from studies.chen.published import CHOSEN, TABLE_4, THRESHOLD
from studies.chen.responses import LEVEL
from studies.chen.study import Results
from studies.chen.words import KINDS


@style.styled
def chains(results: Results) -> Figure:
    """Draw Fig. 5: every chain of each parameter against evaluations for G_1, G_6, G_8."""
    figure = style.new_figure(6.6)
    panels = figure.subplots(4, 3, sharey='row', sharex='col')
    for column, (name, entry) in enumerate(results.shown('matched').items()):
        run = entry.published.chains
        at = [evaluations_at(run, g) for g in range(len(run.draws))]
        for row, parameter in enumerate(BASE):
            axes = panels[row, column]
            for chain in range(run.draws.shape[1]):
                axes.plot(
                    at, run.draws[:, chain, row], lw=0.5, color=COLOURS[chain % 3], alpha=0.8
                )
            axes.set_ylim(parameter.lower, parameter.upper)
            axes.locator_params(axis='x', nbins=3)
            if column == 0:
                axes.set_ylabel(style.label(parameter.name, parameter.unit))
        panels[0, column].set_title(shaping_title(name, entry.shaping_factor), loc='center')
        panels[3, column].set_xlabel('evaluations')
    figure.align_ylabels()
    return figure


@style.styled
def convergence(results: Results) -> Figure:
    """Draw Fig. 6: R-hat against evaluations for G_8, G_6, G_1, as published and ours."""
    figure = style.new_figure(4.6)
    panels = figure.subplots(2, 3, sharex='row', sharey=True)
    for column, (name, entry) in enumerate(reversed(results.shown('matched').items())):
        for axes, trace in zip(
            panels[:, column], (entry.published_trace, entry.ours_trace), strict=True
        ):
            for i, parameter in enumerate(BASE):
                axes.plot(
                    trace.evaluations,
                    trace.rhat[:, i],
                    DASHES[i],
                    color=COLOURS[i],
                    label=style.SYMBOL[parameter.name],
                )
            axes.axhline(THRESHOLD, color='black', lw=0.8, ls=REFERENCE, label=f'{THRESHOLD:g}')
            axes.set(ylim=(0.95, 3.0), xlabel='evaluations', xscale='log')
            axes.set_xlim(100, trace.evaluations[-1])
        panels[0, column].set_title(shaping_title(name, entry.shaping_factor), loc='center')
    panels[0, 0].set_ylabel('R-hat, three chains\nfrom the prior')
    panels[1, 0].set_ylabel('R-hat, ours\n(annealed start)')
    style.legend(figure, panels[0, 0], columns=5)
    return figure


@style.styled
def spread_against_g(results: Results) -> Figure:
    """Draw COV of each parameter, and held-out coverage of the GLUE band, against G."""
    figure = style.new_figure(3.6)
    left, right = figure.subplots(1, 2)
    looks = zip(results.shaped.items(), ('-', '--'), ('full', 'none'), strict=True)
    for (kind, entries), dash, fill in looks:
        factor = [s.shaping_factor for s in entries]
        for i, parameter in enumerate(BASE[:3]):
            left.plot(
                factor,
                [s.ours.moments.cov[i] for s in entries],
                dash,
                marker=MARKS[i],
                color=COLOURS[i],
                fillstyle=fill,
                label=style.SYMBOL[parameter.name] if kind == 'sensor' else None,
            )
        right.plot(
            factor,
            [100 * s.held_out for s in entries],
            dash,
            marker='o',
            fillstyle=fill,
            color='black',
            label=KINDS[kind],
        )
    left.plot(
        [CHOSEN] * 3,
        TABLE_4['cov'][:3],
        '*',
        ms=9,
        color=style.PUBLISHED,
        label='Table 4',
        zorder=5,
    )
    right.axhline(100 * LEVEL, color=style.TRUTH, lw=0.9, label=f'nominal {100 * LEVEL:g} %')
    for kind, dash in zip(results.shaped, ('-', '--'), strict=True):
        left.plot([], [], dash, color='black', label=KINDS[kind])
    for axes in (left, right):
        axes.set_xscale('log', base=2)
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel('shaping factor G')
    left.set(yscale='log', ylabel='COV', title='(a) spread', ylim=(8e-4, 12))
    right.set(ylim=(0, 103), ylabel='held-out samples inside [%]', title='(b) 95 % GLUE band')
    left.legend(loc='upper right', ncols=2, fontsize=7.5)
    right.legend(loc='center left', fontsize=7.5)
    return figure
