"""The stability of a hybrid test as pictures and pages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actuator_glue.api.stability_data import StabilityData
from actuator_glue.api.virtual_test import CRITERIA
from actuator_glue.hybrid.stability import FEW
from actuator_glue.report import html, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuator_glue.api.spread import Spread
    from actuator_glue.api.virtual_test import VirtualResult
    from actuator_glue.hybrid.stability import Share

HEADER = ('quantity', 'unit', 'mean', 'sd', '2.5 %', '97.5 %')


@style.styled
def stability_figure(found: StabilityData) -> Figure:
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


def rows(found: StabilityData) -> list[tuple[str, ...]]:
    """Return a row of text for each distribution over the draws, under HEADER."""

    def row(name: str, unit: str, of: Spread, scale: float = 1.0) -> tuple[str, ...]:
        numbers = (of.mean, of.stddev, of.lower, of.upper)
        return (name, unit, *(f'{scale * v:.4g}' for v in numbers))

    out = [row('delay margin left', 'ms', found.margin_s, 1e3)] if found.margin_s else []
    for effect, cost in found.effect_cost_s.items():
        out.append(row(f'... of it {effect} costs', 'ms', cost, 1e3))
    out.append(row('rightmost root, real part', '1/s', found.growth_per_s))
    out.append(row('actuator bandwidth (-3 dB)', 'Hz', found.bandwidth_hz))
    if found.virtual is not None:
        for name, of in found.virtual.indicators.items():
            text, unit, scale = _shown(name)
            out.append(row(text, unit, of, scale))
    for at in found.tracking:
        out.append(row(f'actuator delay at {at.frequency_hz:g} Hz', 'ms', at.delay_s, 1e3))
        out.append(row(f'actuator amplitude at {at.frequency_hz:g} Hz', '-', at.amplitude))
    return out


def _shown(name: str) -> tuple[str, str, float]:
    """Return text, unit and factor of an indicator's name."""
    if name == 'J1_s':
        return 'J1, lag of the piston', 'ms', 1e3
    if name.startswith('peak_'):
        _, what, unit = name.split('_')
        return f'peak {what}', *(('mm', 1e3) if unit == 'm' else ('kN', 1e-3))
    return {'J2': 'J2, rms of tracking', 'J3': 'J3, peak of tracking'}.get(name, name), '%', 100.0


def lines(found: StabilityData) -> list[str]:
    """Return margin, virtual test and sensitivity, a line each."""
    out = [_margin(found)]
    if found.virtual is not None:
        virtual = found.virtual
        out.append(
            f'{virtual.ground_motion}, {virtual.duration_s:g} s: {_probability(virtual.diverged)} '
            'of the draws diverge'
        )
        for failure in virtual.failures:
            out.append(
                f'P({failure.criterion} > {failure.limit:g} {CRITERIA[failure.criterion]}) = '
                f'{_probability(failure.probability)}'
            )
    if found.most_sensitive is None:
        few = found.draws < FEW
        out.append(
            f'{found.draws} draws are too few to say what the margin follows'
            if few
            else 'the margin does not vary over the draws'
        )
    else:
        rho = found.sensitivity[found.most_sensitive]
        out.append(f'the margin follows {found.most_sensitive} most (rank correlation {rho:+.2f})')
    return out


def _probability(of: Share) -> str:
    return f'{of.value:.4g} ({100 * of.level:g} % interval {of.lower:.3g} to {of.upper:.3g})'


def _margin(found: StabilityData) -> str:
    margin = found.delay_margin
    if not np.isfinite(margin.pure_delay):
        return 'no pure delay makes this loop unstable'
    return (
        f'delay margin with a pure delay: {1e3 * margin.pure_delay:.3f} ms; sampled at '
        f'{found.rate_hz:g} Hz: {1e3 * margin.sampled:.3f} ms'
    )


@style.styled
def response_figure(found: VirtualResult) -> Figure:
    """Draw each floor's 95 % band over time with the reference structure's response."""
    floors = found.median.shape[1]
    figure = style.new_figure(1.2 + 1.4 * min(floors, 4))
    axes = figure.subplots(min(floors, 4), 1, sharex=True, squeeze=False)[:, 0]
    for floor, ax in enumerate(axes):
        ax.fill_between(
            found.time_s,
            1e3 * found.lower[:, floor],
            1e3 * found.upper[:, floor],
            color=style.BAND,
            label='95 % of the draws',
        )
        reference = 1e3 * found.reference[:, floor]
        ax.plot(found.time_s, reference, color=style.MEASURED, lw=0.5, label='reference')
        ax.set_ylabel(f'floor {floor + 1} [mm]')
    axes[0].legend(loc='upper right')
    axes[-1].set_xlabel('time [s]')
    return figure


def brief(found: StabilityData) -> list[html.Block]:
    """Return problems, summary, the distributions over the draws and notes."""
    return [
        *(html.Note(line) for line in found.problems),
        html.Text(f'{found.partition}: {found.summary()}'),
        html.Text(f'{". ".join(lines(found))}. Compensator: {found.compensator}.'),
        html.Table(HEADER, rows(found), 'Over the draws'),
        *(html.Note(line) for line in found.notes),
    ]


def page(found: StabilityData) -> html.Page:
    """Return the report."""
    pictures = [
        html.Picture.of(
            stability_figure(found), 'Each draw of the posterior; the line is the limit.'
        )
    ]
    if found.virtual is not None and found.virtual.indicators:
        picture = response_figure(found.virtual)
        pictures.append(html.Picture.of(picture, f'Floors under {found.virtual.ground_motion}.'))
    section = html.Section(f'Stability of {found.partition}', [*brief(found), *pictures])
    lead = '; '.join((*found.problems, found.summary()))
    return html.Page('Hybrid test', lead, [section], f'{found.draws} draws')
