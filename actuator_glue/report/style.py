"""The look of every figure: style file, colours by role, and how a figure becomes a file."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib.style
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import ArrayLike

from actuator_glue.errors import printable
from actuator_glue.motion import spoken, spoken_of
from actuator_glue.whole_file import whole_file

P = ParamSpec('P')
R = TypeVar('R')

POINTS = 4000  # of a line: more cannot be seen
STYLE_FILE = Path(__file__).with_name('actuator_glue.mplstyle')
WIDTH = 7.2  # in, the text width of an A4 page
NARROW = 4.2  # in, of a phone

# Colour by role, the same in every figure (Okabe & Ito); print keeps them apart by lightness.
COMMAND = '#777777'
MEASURED = '#000000'
DETERMINISTIC = '#D55E00'
BAND = '#0072B2'
LIGHT_BAND = '#56B4E9'
TOTAL = '#009E73'
TRUTH = '#009E73'
WARNING = '#CC79A7'
PUBLISHED = '#E69F00'
NOISE = '#dddddd'

# How symbols are written in figures.
SYMBOL = {
    'beta_1': r'$\beta_1$',
    'alpha_1_beta_0': r'$\alpha_1\beta_0$',
    'alpha_2': r'$\alpha_2$',
    'alpha_3': r'$\alpha_3$',
}
UNIT = {'1': '-'}


def label(name: str, unit: str, exponent: int = 0) -> str:
    """Return an axis label: symbol and unit, values in units of 10^exponent."""
    power = rf'$10^{{{exponent}}}$ ' if exponent else ''
    unit = spoken(unit)
    shown = UNIT.get(unit) or re.sub(r'\^(\d)', r'$^\1$', unit)
    return f'{SYMBOL.get(name, name.replace("_", " "))} [{power}{shown}]'


def engineering(*values: ArrayLike) -> int:
    """Return the exponent, a multiple of 3, in whose units the largest value is 1 to 1000.

    With it in the label no axis needs a power of ten beside it, where other texts are.
    """
    sizes = [np.abs(np.asarray(v, dtype=np.float64)) for v in values]
    largest = max((float(np.nanmax(s)) for s in sizes if np.isfinite(s).any()), default=0.0)
    if not 0.0 < largest < np.inf or 0.1 <= largest < 1e4:
        return 0
    return 3 * math.floor(math.log10(largest) / 3)


def fit(text: str, width: float, *, tail: str = '', size: float = 9.0) -> str:
    """Return text and tail, the middle of the text left out where both are wider than a width.

    Args:
        text: a name of any length.
        width: room [in].
        tail: put behind the text, always whole.
        size: of the letters [pt].
    """
    text = printable(text)  # no font has what a file name may hold
    room = max(int(72 * width / (0.56 * size)) - len(tail), 12)
    if len(text) > room:
        text = f'{text[: room - 3 - room // 3]}...{text[-(room // 3) :]}'
    return text.replace('$', r'\$') + tail  # a name is no formula


def decades(axis: Axis) -> None:
    """Number a logarithmic axis as people read it: 1, 2, 5, 10, no powers of ten."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f'{value:g}'))
    axis.set_minor_formatter(NullFormatter())


def styled(draw: Callable[P, R]) -> Callable[P, R]:
    """Make a drawing function use the style file without touching global matplotlib state."""

    @wraps(draw)
    def within(*args: P.args, **kwargs: P.kwargs) -> R:
        with matplotlib.style.context(str(STYLE_FILE)):
            drawn = draw(*args, **kwargs)
            if isinstance(drawn, Figure):
                _speak(drawn)
            return drawn

    return within


class Drawing(Figure):
    """A figure that a notebook shows without any spell: it needs no pyplot and no backend.

    Attributes:
        motion: whose units its texts have, however and whenever it is shown.
    """

    motion: str

    def draw(self, renderer: RendererBase) -> None:
        """Draw the figure in the units of its motion."""
        _speak(self)
        super().draw(renderer)

    def _repr_png_(self) -> bytes:
        return png(self)


def new_figure(height: float, width: float = WIDTH, *, motion: str | None = None) -> Figure:
    """Return an empty figure [in]; call it from a `styled` function.

    Args:
        height: of it [in].
        width: of it [in].
        motion: what its records measure; None for what is spoken of.
    """
    figure = Drawing(figsize=(width, height), layout='constrained')
    figure.motion = spoken_of() if motion is None else motion
    return figure


def panels(
    count: int, columns: int, height: float, rest: float = 0.0, **shared: Any
) -> tuple[Figure, list[Axes]]:
    """Return a figure with so many panels, row by row; call it from a `styled` function.

    Args:
        count: of panels.
        columns: in which they stand.
        height: of a row [in].
        rest: of the height, for legend and title [in].
        shared: axes that they share, as `Figure.subplots` takes them.
    """
    rows = -(-count // columns)
    figure = new_figure(height * rows + rest)
    grid = figure.subplots(rows, columns, squeeze=False, **shared).ravel()
    for unused in grid[count:]:
        unused.set_visible(False)
    return figure, [*grid[:count]]


def legend(figure: Figure, *panels: Axes, columns: int = 3, scale: float = 1.0) -> None:
    """Put the legend of some panels below all of them, where it covers nothing; a name is once.

    Args:
        figure: of the panels.
        panels: whose curves are named.
        columns: of the legend.
        scale: of its markers, over those in the panels.
    """
    named: dict[str, Artist] = {}
    for axes in panels:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(str(name), handle)
    marks, texts = named.values(), named.keys()
    figure.legend(marks, texts, loc='outside lower center', ncols=columns, markerscale=scale)


@styled
def narrowed(figure: Figure) -> bool:
    """Lay a figure out anew, as wide as a phone, its panels one below the other.

    They follow each other row by row; column by column where only the first row has titles.
    Returns whether that was done: neither a matrix nor panels over several columns are a list.
    """
    panels = {a: spec for a in figure.axes if a.get_visible() and (spec := a.get_subplotspec())}
    grids = {spec.get_gridspec() for spec in panels.values()}
    if len(grids) != 1 or any(len(spec.colspan) > 1 for spec in panels.values()):
        return False
    rows, columns = grids.pop().get_geometry()
    if rows == columns > 2:
        return False
    order = list(panels)
    if columns > 1:
        if rows > 1 and not any(a.get_title('left') for a in order if panels[a].rowspan.start):
            order.sort(key=lambda axes: panels[axes].colspan.start)
        for axes in order:
            row = panels[axes].rowspan
            left = next(a for a in order if panels[a].rowspan == row)
            axes.set_ylabel(axes.get_ylabel() or left.get_ylabel())
            axes.tick_params(labelleft=True)
        grid = figure.add_gridspec(len(order), 1)
        for at, axes in enumerate(order):
            axes.set_subplotspec(grid[at])
    height = figure.get_size_inches()[1]
    figure.set_size_inches(NARROW, height * len(order) / rows)
    for legend in [*figure.legends]:
        marks = [mark for mark in legend.legend_handles if mark is not None]
        names = [text.get_text() for text in legend.get_texts()]
        canvas: Any = FigureCanvasAgg(figure)
        renderer = canvas.get_renderer()
        for count in (3, 2, 1):  # as many columns as there is room for
            legend.remove()
            legend = figure.legend(marks, names, loc='outside lower center', ncols=count)
            if legend.get_window_extent(renderer).width <= figure.bbox.width:
                break
    return True


def _speak(figure: Figure) -> None:
    """Say sizes in the units of the motion that is drawn, or else is spoken of."""
    motion = figure.motion if isinstance(figure, Drawing) else None
    for text in figure.findobj(Text):
        if (told := spoken(text.get_text(), motion)) != text.get_text():
            text.set_text(told)


@styled
def save(figure: Figure, path: Path) -> Path:
    """Write a figure to a file, its format taken from the suffix (png, svg, pdf); return the path.

    Raises:
        InputError: the file cannot be written.
    """
    _speak(figure)
    with whole_file(path) as part:
        figure.savefig(part)
    return path


@styled
def png(figure: Figure) -> bytes:
    """Return a figure as a PNG image."""
    buffer, shown = io.BytesIO(), figure.dpi
    figure.set_dpi(float(matplotlib.rcParams['savefig.dpi']))
    _speak(figure)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.print_png(buffer)  # `savefig` would draw it twice
    figure.set_dpi(shown)
    return buffer.getvalue()


def data_uri(figure: Figure) -> str:
    """Return a figure as a PNG data URI, for an HTML page that needs no other file."""
    return 'data:image/png;base64,' + base64.b64encode(png(figure)).decode('ascii')
