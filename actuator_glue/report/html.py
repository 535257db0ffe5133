"""One-file HTML reports: text, tables and figures in order, images embedded, no outside links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from matplotlib.figure import Figure

from actuator_glue import __version__
from actuator_glue.motion import spoken
from actuator_glue.report.page_name import page_path
from actuator_glue.report.style import data_uri, narrowed
from actuator_glue.whole_file import whole_file

TEMPLATES = Path(__file__).with_name('templates')


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph; plain strings are escaped, `markupsafe.Markup` is kept."""

    text: str
    kind: str = field(default='text', init=False)


@dataclass(frozen=True, slots=True)
class Note:
    """A finding set apart from the running text."""

    text: str
    kind: str = field(default='note', init=False)


@dataclass(frozen=True, slots=True)
class Table:
    """A table with a caption; every row as long as the header; prose for columns of text."""

    header: Sequence[str]
    rows: Sequence[Sequence[object]]
    caption: str
    prose: bool = False
    kind: str = field(default='table', init=False)


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure with a caption; the image is rendered when the block is made.

    Attributes:
        uri: the image.
        caption: what it shows.
        narrow: the same for a phone; empty where the one is shown smaller there.
    """

    uri: str
    caption: str
    narrow: str = ''
    kind: str = field(default='picture', init=False)

    @classmethod
    def of(cls, figure: Figure, caption: str, narrow: Figure | None = None) -> Picture:
        """Render a matplotlib figure, and one as wide as a phone that shows the same.

        Where none is given for a phone the figure itself is laid out anew, if it can be.
        """
        wide = data_uri(figure)
        if narrow is None and narrowed(figure):
            narrow = figure
        return cls(wide, caption, '' if narrow is None else data_uri(narrow))


Block = Text | Note | Table | Picture


@dataclass(frozen=True, slots=True)
class Section:
    """A numbered section of a report."""

    title: str
    blocks: Sequence[Block]


class Page(NamedTuple):
    """A report.

    Attributes:
        title: its title.
        lead: one paragraph that says what was done and what came out.
        sections: numbered in this order; tables and figures are numbered through.
        made: one line on how and when it was made (the caller's clock and arguments).
    """

    title: str
    lead: str
    sections: Sequence[Section]
    made: str = ''


def _template(name: str) -> Template:
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(f'{name}.html.j2')


def fragment(blocks: Sequence[Block]) -> str:
    """Return blocks as HTML without a page around them, for notebooks."""
    return spoken(_template('fragment').render(blocks=blocks))


def render(page: Page) -> str:
    """Return the whole page as HTML.

    Raises:
        ValueError: a table row with another length than its header.
    """
    for section in page.sections:
        for block in section.blocks:
            if isinstance(block, Table) and any(len(r) != len(block.header) for r in block.rows):
                raise ValueError(f'table {block.caption!r}: a row is not as long as the header')
    return spoken(_template('report').render(**page._asdict(), version=__version__))


def write(path: Path | str, page: Page) -> Path:
    """Write the page to a file and return its path; errors as `render`.

    Raises:
        InputError: no path, its name says another format, or the file cannot be written.
    """
    path = page_path(path)
    text = render(page)
    with whole_file(path) as part:
        # A file name may hold bytes that are no text.
        part.write_text(text, encoding='utf-8', errors='backslashreplace')
    return path
