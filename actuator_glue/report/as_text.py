"""Blocks of a report as a few lines of plain text, for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from actuator_glue.report.html import Block, Picture, Table

WIDTH = 100  # letters of a line
LINES = 22  # at most, whatever a result holds


def as_text(blocks: Sequence[Block], rest: str) -> str:
    """Return blocks as text, cut off after some lines.

    Args:
        blocks: what came out, most telling first.
        rest: where what was cut off is shown.
    """
    lines = [line for block in blocks for line in _lines(block)]
    if len(lines) > LINES:
        lines = [*lines[: LINES - 1], f'... {len(lines) - LINES + 1} more lines: {rest}']
    return '\n'.join(lines)


def _lines(block: Block) -> Iterator[str]:
    if isinstance(block, Picture):
        return
    if not isinstance(block, Table):
        yield from textwrap.wrap(block.text, WIDTH) or ['']
        return
    rows = [[str(cell) for cell in row] for row in (block.header, *block.rows)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    yield block.caption
    for row in rows:
        cells = (
            c.rjust(w) if i else c.ljust(w)
            for i, (c, w) in enumerate(zip(row, widths, strict=True))
        )
        yield f'  {"  ".join(cells)}'[:WIDTH].rstrip()
