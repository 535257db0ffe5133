"""What commands write for people: lines, tables, blocks of a report."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from actuator_glue.arguments import Output, add_force, make_room
from actuator_glue.errors import InputError, printable
from actuator_glue.motion import spoken
from actuator_glue.report.page_name import page_path

if TYPE_CHECKING:
    from actuator_glue.report.html import Block


def _told(text: str) -> str:
    """Return a text for people: printable, and in the units of the records' motion."""
    return spoken(printable(text))


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json OUT` and `--force`."""
    parser.add_argument(
        '--json',
        type=Output,
        metavar='OUT',
        help="also write the result as JSON; '-' is standard output",
    )
    add_force(parser)


def add_report(parser: argparse.ArgumentParser) -> None:
    """Add `--report OUT.html`; another format is refused before any long work."""
    parser.add_argument(
        '--report', type=_page, metavar='OUT.html', help='also write a report, one HTML file'
    )


def _page(text: str) -> Output:
    try:
        page_path(text)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return Output(text)


def beside(out: str | None, write: Callable[[str], object]) -> int:
    """Write a file that goes beside an answer; what fails is told and ends nothing.

    Numbers are written before the answer is printed; pictures after it, as they take their time.

    Args:
        out: the file; None where nobody asked for it.
        write: writes it.

    Returns:
        2 where the file cannot be written, else 0: a fault in drawing takes nothing from the
        answer and its exit code.
    """
    if out is None:
        return 0
    try:
        if out != '-':
            make_room(out)
        write(out)
    except (InputError, OSError) as error:
        fault(str(error))
        return 2
    except Exception as error:
        note(
            f'{out}: could not be made ({type(error).__name__}: {error}); this is a fault of '
            'actuator-glue, please report it. The answer stands'
        )
    return 0


def fault(line: str) -> None:
    """Print what is wrong on standard error."""
    print(f'actuator-glue: {_told(line)}', file=sys.stderr)


def note(line: str) -> None:
    """Print one remark on standard error."""
    print(f'note: {_told(line)}', file=sys.stderr)


def say(line: str, args: argparse.Namespace) -> None:
    """Print one line for people; on standard error where JSON goes to standard output."""
    print(_told(line), file=sys.stderr if getattr(args, 'json', None) == '-' else sys.stdout)


def table(
    title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], args: argparse.Namespace
) -> None:
    """Print a table; every column but the first is right-aligned."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for i, column in enumerate(columns):
        shown.add_column(
            escape(_told(column)), justify='left' if i == 0 else 'right', no_wrap=True
        )
    for row in rows:
        shown.add_row(*(escape(_told(cell)) for cell in row))
    file = sys.stderr if getattr(args, 'json', None) == '-' else sys.stdout
    console = Console(file=file, highlight=False)
    if title:  # on a line of its own: one of the table would be folded to the table's width
        console.print(_told(title), style='italic', markup=False, emoji=False, soft_wrap=True)
    # A number that is cut off is worse than a line that the terminal folds.
    needed = console.measure(shown, options=console.options.update(max_width=500)).maximum
    Console(file=file, highlight=False, width=max(console.width, needed)).print(shown)


def show(blocks: Iterable[Block], args: argparse.Namespace) -> None:
    """Print blocks of a report but its pictures; notes go to standard error."""
    from actuator_glue.report.html import Note, Picture, Table

    for block in blocks:
        if isinstance(block, Table):
            rows = [[str(cell) for cell in row] for row in block.rows]
            table(block.caption, block.header, rows, args)
        elif isinstance(block, Note):
            note(block.text)
        elif not isinstance(block, Picture):
            say(block.text, args)
