"""Pictures of a run: forecasts while the model changed, the residual before and after."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator_glue.diagnosis.telling.result import DiagnosisData
from actuator_glue.diagnosis.verdict.traces import Trace
from actuator_glue.errors import InputError
from actuator_glue.model.parameters import BASE
from actuator_glue.online.job import WindowResult
from actuator_glue.online.stream import structure_effects, structure_name, structure_weights
from actuator_glue.records import Array
from actuator_glue.report import style
from actuator_glue.report.bag_content import Content

UM = 1e6
MM = 1e3
POINTS = 4000  # in a scatter plot; more only blacken it
SECONDS = 0.6  # of residual drawn against time
COLOURS = (style.BAND, style.PUBLISHED, style.WARNING, style.LIGHT_BAND, style.DETERMINISTIC)


@style.styled
def live(content: Content, path: Path) -> Path:
    """Draw how far the forecasts were off, hop by hop, and where the model was changed.

    Raises:
        InputError: the bag holds no scored bands.
    """
    hops = [b for b in content.bands if b.kind == 'noise']
    if not hops:
        raise InputError('the estimator published no scored bands')
    first, period = content.record.first_index, content.record.period
    time = [(int(b.index) - first + len(b.median) / 2) * period for b in hops]
    figure = style.new_figure(3.8)
    upper, lower = figure.subplots(2, 1, sharex=True)
    upper.plot(time, [1e6 * b.rms_error for b in hops], '-o', color=style.BAND)
    upper.set(ylabel='rms error of the\nforecast [um]', ylim=(0, None))
    lower.plot(time, [100 * b.widest_coverage for b in hops], '-o', color=style.BAND)
    lower.axhline(100 * float(hops[-1].widest_level), ls=':', color=style.COMMAND)
    lower.set(ylabel='samples in the band of\nparameters and noise [%]', ylim=(0, 103))
    lower.set_xlabel('time [s]')
    for i, (start, name) in enumerate(_changes(content)):
        for axes in (upper, lower):
            axes.axvline((start - first) * period, ls='--', color=style.TRUTH)
        upper.annotate(
            f' {name}',
            ((start - first) * period, 0.97 - 0.13 * (i % 2)),  # names are long
            xycoords=('data', 'axes fraction'),
            color=style.TRUTH,
            va='top',
        )
    figure.suptitle(_came_to(content, hops))
    return style.save(figure, path)


def _came_to(content: Content, hops: Sequence[Any]) -> str:
    """Say what a run came to: the error of its forecasts before and after its model changed."""
    changes = _changes(content)

    def middle(start: int, stop: float) -> str:
        """Return the median rms error of the forecasts that begin between two samples."""
        chosen = [UM * b.rms_error for b in hops if start <= int(b.index) < stop]
        return f'{np.median(chosen):.1f} um' if chosen else 'none'

    first = changes[0][0] if changes else np.inf
    text = f'Forecasts, median rms error: {middle(0, first)} with the first model'
    if not changes:
        return f'{text}, which was not changed'
    start, name = changes[-1]
    # A long name is cut, its number never.
    after = f'{middle(start, np.inf)} with '
    return f'{text},\n{style.fit(after + name, style.WIDTH, size=10)}'


@style.styled
def explanations(content: Content, path: Path, hidden: Sequence[str]) -> Path:
    """Draw the weight of each explanation over time, one on the other.

    Args:
        content: the bag of a run.
        path: where the picture goes.
        hidden: effects of a simulated actuator, which are marked; empty where nobody knows.
    """
    first, posteriors = content.record.first_index, content.posteriors
    time = [(int(p.index) + int(p.samples) - first) * float(p.period) for p in posteriors]
    told = [dict(structure_weights(p)) for p in posteriors]
    true = next((name for one in told for name in one if _is(name, hidden)), '')
    plain = structure_name(())
    names = list(dict.fromkeys([true] * bool(true) + [n for one in told for n in one]))
    others = iter(COLOURS * len(names))
    known = {true: style.TRUTH, plain: style.COMMAND}
    figure = style.new_figure(2.8)
    axes = figure.subplots()
    below = np.zeros(len(time))
    for name in names:
        above = below + [100.0 * one.get(name, 0.0) for one in told]
        axes.fill_between(
            time,
            below,
            above,
            step='pre',
            lw=0.5,
            color=known.get(name) or next(others),
            label=f'{name} (the truth)' if name == true and hidden else name,
        )
        below = above
    axes.set(ylim=(0, 100), xlim=(time[0], time[-1]), xlabel='time [s]')
    axes.set(ylabel='weight of the\nexplanation [%]')
    figure.legend(*axes.get_legend_handles_labels(), loc='outside lower center', ncols=2)
    last = max(told[-1], key=lambda name: told[-1][name])
    title, weight = f'Explanations over time; at the end {last}', f', {told[-1][last]:.0%}'
    figure.suptitle(style.fit(title, style.WIDTH, tail=weight, size=10))
    return style.save(figure, path)


def _is(name: str, effects: Sequence[str]) -> bool:
    return set(structure_effects(name)) == set(effects)


@style.styled
def carried(
    content: Content, boxed: Sequence[WindowResult], path: Path, truth: Array | None
) -> Path:
    """Draw each window's 95 % interval of Eq. (2)'s parameters, from the box and with the prior.

    A parameter that drifts is drawn once more, larger, where the last model is used.

    Args:
        content: the bag of a run whose windows began with what was known before.
        boxed: some of its windows, estimated from the box.
        path: where the picture goes.
        truth: true parameters of a simulated actuator in each window, shape (windows, 4).
    """
    drifting = [] if truth is None else np.flatnonzero(np.ptp(truth, axis=0)).tolist()
    figure = style.new_figure(4.6 + 1.8 * len(drifting))
    rows: list[Any] = [[0, 1], [2, 3], *([f'drift {j}'] * 2 for j in drifting)]
    panels: Any = figure.subplot_mosaic(rows)
    first, period = content.record.first_index, content.record.period
    for j, parameter in enumerate(BASE):
        axes = panels[j]
        for number, result in enumerate(boxed):
            draws = result.frozen.draws[:, j] if result.frozen is not None else np.empty(0)
            axes.plot(
                2 * [(result.window.end - first) * period],
                np.quantile(draws, (0.025, 0.975)),
                color=style.COMMAND,
                lw=6,
                alpha=0.5,
                solid_capstyle='butt',
                label='from the box' if number == 0 else None,
            )
        _followed(axes, content, j, truth)
        for start, _ in _changes(content):
            axes.axvline((start - first) * period, ls=':', color=style.TRUTH)
        axes.set(ylabel=style.label(parameter.name, parameter.unit))
        # Of these the box leaves orders of magnitude open.
        axes.set(yscale='log') if j > 0 else axes.set(ylim=(0.0, None))
        if j > 1:
            axes.set_xlabel('time [s]')
    for j in drifting:
        axes = panels[f'drift {j}']
        _followed(axes, content, j, truth, under_last=True)
        axes.set(ylabel=style.label(BASE[j].name, BASE[j].unit), xlabel='time [s]')
        axes.set_title('its drift while the oil warms, in the windows of the last model')
    figure.legend(*panels[0].get_legend_handles_labels(), loc='outside lower center', ncols=3)
    figure.suptitle('95 % of each window: from the box, and with what was known before it')
    return style.save(figure, path)


def _followed(
    axes: Axes, content: Content, j: int, truth: Array | None, *, under_last: bool = False
) -> None:
    """Draw the 95 % interval of parameter j in each window, and its true value there."""
    first, last = content.record.first_index, content.posteriors[-1]
    shown = np.array(
        [not under_last or list(p.effects) == list(last.effects) for p in content.posteriors]
    )
    end = [(int(p.index) + int(p.samples) - first) * float(p.period) for p in content.posteriors]
    middle, half = (
        scale * np.array([getattr(p, column)[j] for p in content.posteriors])[shown]
        for column, scale in (('mean', 1.0), ('stddev', 1.96))
    )
    time = np.array(end)[shown]
    axes.fill_between(time, middle - half, middle + half, color=style.BAND, label='carried on')
    if truth is not None:
        axes.plot(time, truth[shown, j], ls='--', color=style.TRUTH, label='truth')


def _changes(content: Content) -> list[tuple[int, str]]:
    """Return first forecast sample and effects of each model after the first."""
    found = []
    pairs = zip(content.posteriors, content.posteriors[1:], strict=False)
    for before, after in pairs:
        if list(before.effects) != list(after.effects):
            name = ' + '.join(['Eq. (2)', *after.effects])
            found.append((int(after.index) + int(after.samples), name))
    return found


def residual(diagnosis: DiagnosisData, path: Path) -> Path:
    """Draw the held-out residual before and after, against time and against displacement."""
    held = [t for t in diagnosis.traces if t.held_out]
    trace = max(held or diagnosis.traces, key=lambda t: len(t.measured))
    return style.save(_draw(diagnosis, trace), path)


@style.styled
def _draw(diagnosis: DiagnosisData, trace: Trace) -> Figure:
    figure = style.new_figure(4.6)
    panels = figure.subplots(2, 2, sharex='col', sharey=True, width_ratios=(1.7, 1.0))
    with_effects = ' + '.join(['Eq. (2)', *diagnosis.structure])
    rows = (
        ('Eq. (2) alone', trace.before, diagnosis.error.before, style.DETERMINISTIC),
        (with_effects, trace.after, diagnosis.error.after, style.BAND),
    )
    part, pick = _stretch(trace), slice(None, None, 1 + len(trace.time) // POINTS)
    limit = 1.15 * UM * float(np.quantile(np.abs(trace.measured - trace.before), 0.999))
    for (name, simulated, rms, colour), (left, right) in zip(rows, panels, strict=True):
        residual = UM * (trace.measured - simulated)
        left.plot(trace.time[part], residual[part], color=colour, lw=0.8)
        right.plot(MM * trace.measured[pick], residual[pick], '.', ms=1.5, color=colour)
        left.set(ylim=(-limit, limit), ylabel='residual [um]')
        left.set_title(f'{name}: {UM * rms:.1f} um rms')
    panels[1, 0].set_xlabel('time [s]')
    panels[1, 1].set_xlabel('displacement [mm]')
    figure.suptitle(
        f'Error on data that decided nothing: {UM * diagnosis.error.before:.1f} -> '
        f'{UM * diagnosis.error.after:.1f} um, noise {UM * diagnosis.error.noise_floor:.1f} um'
    )
    return figure


def _stretch(trace: Trace) -> slice:
    """Return a short stretch without a hole, of the longest one in the middle of the record."""
    period = float(np.median(np.diff(trace.time)))
    pieces = trace.stretches()
    piece = pieces[len(pieces) // 2]
    size = piece.stop - piece.start
    length = min(size, max(2, round(SECONDS / period)))
    start = piece.start + (size - length) // 2
    return slice(start, start + length)
