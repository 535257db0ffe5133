"""What the study's figures share: marks, dashes, colours by role, the legend below."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator_glue.report import style

MARKS = ('o', 's', '^', 'D')
COLOURS = (style.BAND, style.DETERMINISTIC, style.TRUTH, style.WARNING)
DASHES = ('-', '--', '-.', ':')
REFERENCE = (0, (6, 3))  # dashes of a line to compare with


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """Put the legend of one panel below the whole figure."""
    handles, names = axes.get_legend_handles_labels()
    figure.legend(handles, names, loc='outside lower center', ncols=columns)


def shaping_title(name: str, factor: float) -> str:
    """Return the title of a panel about one shaping factor."""
    return f'${name}$ = $2^{{{round(np.log2(factor))}}}$'
