"""The reliability diagram and the coverage of the bands as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from studies.hybrid.judgement import Findings
from studies.hybrid.library import style
from studies.hybrid.trial import Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@style.styled
def reliability_figure(outcomes: Sequence[Outcome], found: Findings) -> Figure:
    """Draw predictions against what happened, and the share of each response in its band."""
    figure = style.new_figure(2.8)
    left, right = figure.subplots(1, 2)
    left.plot([0.0, 1.0], [0.0, 1.0], color=style.COMMAND, lw=0.8)
    for one in found.bins:
        low, high = one.least / one.count, one.most / one.count
        left.plot([one.predicted] * 2, [low, high], color=style.BAND, lw=4.0, alpha=0.4)
        left.plot([one.predicted], [one.unstable / one.count], 'o', color=style.BAND)
        left.annotate(f'  {one.count}', (one.predicted, one.unstable / one.count))
    left.set_xlabel('P(unstable) predicted, mean of the bin')
    left.set_ylabel('share that was unstable')
    held = [100 * o.inside for o in outcomes if o.inside is not None]
    right.hist(held, bins=20, range=(0.0, 100.0), color=style.BAND)
    right.axvline(95.0, color=style.WARNING)
    right.set_xlabel('share of the responses in the 95 % band [%]')
    right.set_ylabel('actuators')
    return figure
