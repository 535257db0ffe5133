"""Figs. 5 and 6, and what G does to the posterior's spread and to its bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from actuator_glue.model.parameters import BASE
from actuator_glue.report import style
from actuator_glue.reproduction.published import CHOSEN, SHOWN, TABLE_4, THRESHOLD
from actuator_glue.reproduction.shaping import LEVEL, Shaped

MARKS = ('o', 's', '^', 'D')
COLOURS = (style.BAND, style.DETERMINISTIC, style.TRUTH, style.WARNING)
DASHES = ('-', '--', '-.', ':')


def shown(shaped: Sequence[Shaped]) -> dict[str, Shaped]:
    """Return the entries for G_1, G_6 and G_8, in this order."""
    by_factor = {s.shaping_factor: s for s in shaped}
    return {name: by_factor[factor] for name, factor in SHOWN.items()}


@style.styled
def chains(shaped: Sequence[Shaped]) -> Figure:
    """Draw Fig. 5: every chain of each parameter against evaluations for G_1, G_6, G_8."""
    rows = shown(shaped)
    figure = style.new_figure(6.6)
    panels = figure.subplots(4, 3, sharey='row', sharex='col')
    for column, (name, entry) in enumerate(rows.items()):
        run = entry.published.chains
        at = [run.evaluations_at(g) for g in range(len(run.draws))]
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
        power = round(np.log2(entry.shaping_factor))
        panels[0, column].set_title(f'${name}$ = $2^{{{power}}}$', loc='center')
        panels[3, column].set_xlabel('evaluations')
    figure.align_ylabels()
    return figure


@style.styled
def convergence(shaped: Sequence[Shaped]) -> Figure:
    """Draw Fig. 6: R-hat against evaluations for G_8, G_6, G_1, as published and ours."""
    rows = shown(shaped)
    figure = style.new_figure(4.6)
    panels = figure.subplots(2, 3, sharex='row', sharey=True)
    for column, name in enumerate(('G_8', 'G_6', 'G_1')):
        entry = rows[name]
        for row, trace in enumerate((entry.published_trace, entry.ours_trace)):
            axes = panels[row, column]
            for i, parameter in enumerate(BASE):
                axes.plot(
                    trace.evaluations, trace.rhat[:, i], DASHES[i], color=COLOURS[i],
                    label=style.SYMBOL[parameter.name],
                )  # fmt: skip
            axes.axhline(THRESHOLD, color='black', lw=0.8, ls=(0, (6, 3)), label='1.2')
            axes.set(ylim=(0.95, 3.0), xlabel='evaluations', xscale='log')
            axes.set_xlim(100, trace.evaluations[-1])
        power = round(np.log2(entry.shaping_factor))
        panels[0, column].set_title(f'${name}$ = $2^{{{power}}}$', loc='center')
    panels[0, 0].set_ylabel('R-hat, three chains\nfrom the prior')
    panels[1, 0].set_ylabel('R-hat, ours\n(annealed start)')
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc='outside lower center', ncols=5)
    return figure


@style.styled
def spread_against_g(shaped: Mapping[str, Sequence[Shaped]], names: Mapping[str, str]) -> Figure:
    """Draw COV of each parameter, and held-out coverage of the GLUE band, against G.

    Args:
        shaped: studies by kind of residual.
        names: what each kind is called in the legend.
    """
    figure = style.new_figure(3.6)
    left, right = figure.subplots(1, 2)
    first = next(iter(shaped))
    for (kind, entries), dash, fill in zip(
        shaped.items(), ('-', '--'), ('full', 'none'), strict=True
    ):
        factor = [s.shaping_factor for s in entries]
        for i, parameter in enumerate(BASE[:3]):
            left.plot(
                factor, [s.ours.moments.cov[i] for s in entries], dash, marker=MARKS[i],
                color=COLOURS[i], fillstyle=fill,
                label=style.SYMBOL[parameter.name] if kind == first else None,
            )  # fmt: skip
        right.plot(
            factor, [100 * s.held_out for s in entries], dash, marker='o', fillstyle=fill,
            color='black', label=names[kind],
        )  # fmt: skip
    left.plot(
        [CHOSEN] * 3, TABLE_4.cov[:3], '*', ms=9, color=style.PUBLISHED, label='Table 4', zorder=5
    )
    right.axhline(100 * LEVEL, color=style.TRUTH, lw=0.9, label='nominal 95 %')
    for kind, dash in zip(shaped, ('-', '--'), strict=True):
        left.plot([], [], dash, color='black', label=names[kind])
    for axes in (left, right):
        axes.set_xscale('log', base=2)
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel('shaping factor G')
    left.set(yscale='log', ylabel='COV', title='(a) spread', ylim=(8e-4, 12))
    right.set(ylim=(0, 103), ylabel='held-out samples inside [%]', title='(b) 95 % GLUE band')
    left.legend(loc='upper right', ncols=2, fontsize=7.5)
    right.legend(loc='center left', fontsize=7.5)
    return figure
