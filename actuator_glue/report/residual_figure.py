"""What a model leaves of each record over time, and what noise makes of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from actuator_glue.records import Array
from actuator_glue.report import style


class Left(NamedTuple):
    """One record: title, time (n,) [s], measured less simulated (n,) [m], rms of the noise [m]."""

    title: str
    time: Array
    residual: Array
    noise: float | None


@style.styled
def residual_figure(records: Sequence[Left], *, narrow: bool = False) -> Figure:
    """Draw each record's residual in um, grey where noise leaves it; `narrow` for a phone."""
    width = style.NARROW if narrow else style.WIDTH
    figure = style.new_figure(0.9 + 1.5 * len(records), width)
    panels = figure.subplots(len(records), 1, squeeze=False, sharey=True)[:, 0]
    for axes, of in zip(panels, records, strict=True):
        if of.noise is not None:
            wide = 2e6 * of.noise
            axes.axhspan(
                -wide, wide, color=style.NOISE, lw=0, label='noise (2 standard deviations)'
            )
        some = slice(None, None, max(1, len(of.time) // style.POINTS))
        axes.plot(
            of.time[some],
            1e6 * of.residual[some],
            color=style.TOTAL,
            lw=0.6,
            label='measured less model',
        )
        axes.set_title(style.fit(of.title, width - 0.7))
        axes.set_ylabel('residual [um]')
    panels[-1].set_xlabel('time [s]')
    style.legend(figure, panels[0], columns=2)
    return figure
