"""A replay as tables and pictures: its windows, and their parameters against time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from actuator_glue.api.replay_data import ReplayData, WindowEstimate
from actuator_glue.api.tracking import shown
from actuator_glue.model.structure import Structure
from actuator_glue.online.stream import structure_effects
from actuator_glue.records import source_name
from actuator_glue.report import html, weights
from actuator_glue.report.first_lines import first_lines
from actuator_glue.report.quantity import plain, said_in
from actuator_glue.report.timeseries import ParameterCourse, parameters_against_time

if TYPE_CHECKING:
    from matplotlib.figure import Figure


Table = tuple[tuple[str, ...], list[tuple[str, ...]]]  # header and rows
ROWS = 20  # windows shown to people; JSON has all
TITLE = 'Posterior mean (SI units) and standard deviation (% of it) of each window'
IF_TRUE = 'The parameters if each explanation of the last window is true: mean +- s. d.'
TRACKING = 'How the actuator followed each window: median (95 % limits)'


def windows_table(found: ReplayData) -> Table:
    """Return header and rows of some windows, evenly chosen where there are many."""
    out = []
    number = _numbered(found)
    for w in _some(_windows(found)):
        coverage = [b.coverage[-1] for b in w.bands if b.kind == 'total']
        out.append(
            (
                number(w),
                f'{w.end_s:.2f}',
                *(f'{p.mean:.4g} {_percent(p.stddev, p.mean)}' for p in w.parameters.values()),
                f'{max(p.rhat for p in w.parameters.values()):.2f}',
                f'{1e6 * w.error.rms_m:.1f}',
                f'{100 * coverage[-1]:.0f} %' if coverage else '-',
            )
        )
    return ('window', 'end [s]', *_names(found), 'R-hat', 'rms [um]', 'cover'), out


def tracking_table(found: ReplayData) -> Table | None:
    """Return header and rows of the tracking numbers; None where nobody asked for them.

    Of each window median and 95 % limits over the draws.
    """
    told = [w for w in _windows(found) if w.tracking is not None]
    if not told:
        return None
    names = list(dict.fromkeys(n for w in told if w.tracking for n in w.tracking.predicted))
    units = [shown(name) for name in names]
    out, number = [], _numbered(found)
    for w in _some(told):
        row = [number(w), f'{w.end_s:.2f}']
        for name, (_, _, factor) in zip(names, units, strict=True):
            of = None if w.tracking is None else w.tracking.predicted.get(name)
            numbers = () if of is None else (of.median, of.lower, of.upper)
            told_as = [f'{factor * v:.4g}' for v in numbers]
            row.append(f'{told_as[0]} ({told_as[1]} to {told_as[2]})' if told_as else '-')
        out.append(tuple(row))
    return ('window', 'end [s]', *(f'{text} [{unit}]' for text, unit, _ in units)), out


def explanations_table(found: ReplayData) -> Table | None:
    """Return header and rows of the explanations over time; None where there was ever one only."""
    course = [(w.end_s, {e.name: e.weight for e in w.explanations}) for w in found.windows]
    told = weights.spells(course)
    several = len({name for spell in told for name in spell.last}) > 1
    return (weights.HEADER, weights.rows(told)) if several else None


def if_true_table(found: ReplayData) -> Table | None:
    """Return what the parameters are if each explanation of the last window is true.

    None where that has one only: what it says is in the table of the windows.
    """
    last = found.windows[-1].explanations if found.windows else ()
    if len(last) < 2:
        return None
    known = {p.name: p for one in last for p in Structure(structure_effects(one.name)).parameters}
    out = []
    for name in dict.fromkeys(name for one in last for name in one.mean):
        sizes = [(one.mean.get(name), one.stddev.get(name)) for one in last]
        factor, unit = said_in(known[name].unit, [mean for mean, _ in sizes if mean is not None])
        told = [
            '-'
            if mean is None or sd is None
            else f'{plain(factor * mean, 4)} +- {plain(factor * sd, 2)}'
            for mean, sd in sizes
        ]
        out.append((name, *told, unit or '-'))
    shares = [f'{one.name} ({100 * one.weight:.0f} %)' for one in last]
    return ('parameter', *shares, 'unit'), out


def _numbered(found: ReplayData) -> Callable[[WindowEstimate], str]:
    """Return what names a window: its number, behind its run's where there are several."""
    if len({w.run for w in found.windows}) > 1:
        return lambda w: f'{w.run}:{w.window}'
    return lambda w: str(w.window)


def _some(windows: list[WindowEstimate]) -> list[WindowEstimate]:
    """Return some windows, evenly chosen where there are many."""
    if len(windows) <= ROWS:
        return windows
    return [windows[i * (len(windows) - 1) // (ROWS - 1)] for i in range(ROWS)]


def _percent(stddev: float, mean: float) -> str:
    return f'{100 * stddev / abs(mean):3.0f}%' if mean else '  -%'


def _names(found: ReplayData) -> list[str]:
    return list(found.windows[-1].parameters)


def _windows(found: ReplayData) -> list[WindowEstimate]:
    """Return the windows with the last window's model: other models have other parameters."""
    names = _names(found)
    return [w for w in found.windows if list(w.parameters) == names]


def brief(found: ReplayData) -> list[html.Block]:
    """Return the summary, the windows, what differs and what limits the answer."""
    told = first_lines(found.notes, 'notes')
    if found.compared is not None:
        differing = first_lines(found.compared.differing, 'differences')
        lost = first_lines(found.compared.unrepeatable, 'windows that cannot be repeated')
        told = [*differing, *lost, *told]
    return [
        html.Text(found.summary()),
        *tables(found),
        *map(html.Note, told),
    ]


def tables(found: ReplayData) -> list[html.Block]:
    """Return the windows, and what else there is to tell of them."""
    told = (
        (TITLE, windows_table(found)),
        (TRACKING, tracking_table(found)),
        (weights.TITLE, explanations_table(found)),
        (IF_TRUE, if_true_table(found)),
    )
    return [html.Table(*table, title) for title, table in told if table is not None]


def page(found: ReplayData) -> html.Page:
    """Return the report of a replay."""
    picture = html.Picture.of(
        parameters_figure(found), 'Every parameter, with two standard deviations.'
    )
    events = [html.Text(line) for line in first_lines(found.events, 'events')]
    sections = [html.Section('Windows', [*brief(found), picture])]
    if events:
        sections.append(html.Section('Events', events))
    return html.Page(f'Replay of {source_name(found.bag)}', found.summary(), sections)


def parameters_figure(found: ReplayData) -> Figure:
    """Draw every parameter's mean and two standard deviations against time."""
    names, windows = _names(found), _windows(found)
    known = {p.name: p for p in Structure(found.effects).parameters}
    mean = np.array([[w.parameters[n].mean for n in names] for w in windows])
    spread = 2.0 * np.array([[w.parameters[n].stddev for n in names] for w in windows])
    time_s = np.array([w.end_s for w in windows])
    course = ParameterCourse(
        time_s, mean, mean - spread, mean + spread, 'mean and two standard deviations'
    )
    return parameters_against_time(course, [known[n] for n in names])
