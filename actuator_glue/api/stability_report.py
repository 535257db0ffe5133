"""The stability of a hybrid test as pictures and pages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actuator_glue.report import html, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuator_glue.api.stability import Spread, StabilityResult

HEADER = ('quantity', 'unit', 'mean', 'sd', '2.5 %', '97.5 %')


@style.styled
def stability_figure(found: StabilityResult) -> Figure:
    """Draw the draws' margins and growth rates, the stability limit at zero."""
    figure = style.new_figure(2.8)
    left, right = figure.subplots(1, 2)
    finite = found.margins_drawn[np.isfinite(found.margins_drawn)]
    for axes, values, text in (
        (left, 1e3 * finite, 'further delay that a draw can bear [ms]'),
        (right, found.growth_drawn, 'rightmost root, real part [1/s]'),
    ):
        axes.hist(values, bins=50, color=style.BAND, histtype='stepfilled')
        axes.axvline(0.0, color=style.WARNING)
        axes.set_xlabel(text)
        axes.set_yticks([])
    left.set_ylabel('draws')
    return figure


def rows(found: StabilityResult) -> list[tuple[str, ...]]:
    """Return a row of text for each distribution over the draws, under HEADER."""

    def row(name: str, unit: str, of: Spread, scale: float = 1.0) -> tuple[str, ...]:
        numbers = (of.mean, of.stddev, of.lower, of.upper)
        return (name, unit, *(f'{scale * v:.4g}' for v in numbers))

    out = [row('delay margin left', 'ms', found.margin_s, 1e3)] if found.margin_s else []
    out.append(row('rightmost root, real part', '1/s', found.growth_per_s))
    out.append(row('actuator bandwidth (-3 dB)', 'Hz', found.bandwidth_hz))
    for at in found.tracking:
        out.append(row(f'actuator delay at {at.frequency_hz:g} Hz', 'ms', at.delay_s, 1e3))
        out.append(row(f'actuator amplitude at {at.frequency_hz:g} Hz', '-', at.amplitude))
    return out


def margin_line(found: StabilityResult) -> str:
    """Return tau_c in one line."""
    margin = found.delay_margin
    if not np.isfinite(margin.pure_delay):
        return 'no pure delay makes this loop unstable'
    return (
        f'delay margin with a pure delay: {1e3 * margin.pure_delay:.3f} ms; sampled at '
        f'{found.rate_hz:g} Hz: {1e3 * margin.sampled:.3f} ms'
    )


def sensitivity_line(found: StabilityResult) -> str:
    """Return which parameter the margin follows most, in one line."""
    if found.most_sensitive is None:
        return 'the margin does not vary over the draws'
    rho = found.sensitivity[found.most_sensitive]
    return f'the margin follows {found.most_sensitive} most (rank correlation {rho:+.2f})'


def brief(found: StabilityResult) -> list[html.Block]:
    """Return problems, summary, the distributions over the draws and notes."""
    return [
        *(html.Note(line) for line in found.problems),
        html.Text(f'{found.partition}: {found.summary()}'),
        html.Text(f'{margin_line(found)}. Compensator: {found.compensator}.'),
        html.Table(HEADER, rows(found), 'Over the draws'),
        html.Text(f'{sensitivity_line(found)}.'),
        *(html.Note(line) for line in found.notes),
    ]


def page(found: StabilityResult) -> html.Page:
    """Return the report."""
    picture = html.Picture.of(found.plot(), 'Each draw of the posterior; the line is the limit.')
    section = html.Section(f'Stability of {found.partition}', [*brief(found), picture])
    lead = '; '.join((*found.problems, found.summary()))
    return html.Page('Hybrid test', lead, [section], f'{found.draws} draws')
