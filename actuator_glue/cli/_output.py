"""What commands write: tables and progress for people, JSON for machines."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from actuator_glue.cli._parser import Output, add_force
from actuator_glue.errors import InputError, printable


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json OUT` and `--force`."""
    parser.add_argument(
        '--json',
        type=Output,
        metavar='OUT',
        help="also write the result as JSON; '-' is standard output",
    )
    add_force(parser)


def note(line: str) -> None:
    """Print one remark on standard error."""
    print(f'note: {printable(line)}', file=sys.stderr)


def say(line: str, args: argparse.Namespace) -> None:
    """Print one line for people; on standard error where JSON goes to standard output."""
    print(printable(line), file=sys.stderr if getattr(args, 'json', None) == '-' else sys.stdout)


def table(
    title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], args: argparse.Namespace
) -> None:
    """Print a table; every column but the first is right-aligned."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    shown = Table(
        title=title or None,
        box=box.SIMPLE_HEAD,
        title_justify='left',
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for i, column in enumerate(columns):
        shown.add_column(escape(column), justify='left' if i == 0 else 'right', no_wrap=True)
    for row in rows:
        shown.add_row(*map(escape, row))
    file = sys.stderr if getattr(args, 'json', None) == '-' else sys.stdout
    console = Console(file=file, highlight=False)
    # A number that is cut off is worse than a line that the terminal folds.
    needed = console.measure(shown, options=console.options.update(max_width=500)).maximum
    Console(file=file, highlight=False, width=max(console.width, needed)).print(shown)


def clean(value: Any) -> Any:
    """Return a value JSON can hold: numpy numbers as numbers, NaN and infinity as null."""
    if isinstance(value, dict):
        return {str(k): clean(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [clean(v) for v in value]
    if hasattr(value, 'tolist'):
        return clean(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_json(content: dict[str, Any], out: str | None) -> None:
    """Write JSON to a file in one step, or to standard output; nothing where `out` is None.

    Raises:
        InputError: the file cannot be written.
    """
    if out is None:
        return
    text = json.dumps(clean(content), indent=2, allow_nan=False) + '\n'
    if out == '-':
        sys.stdout.write(text)
        return
    path = Path(out)
    temporary = path.with_name(path.name + '.tmp')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and not path.is_file():  # a device or pipe stays what it is
            path.write_text(text, 'utf-8')
            return
        temporary.write_text(text, 'utf-8')
        temporary.replace(path)
    except OSError as error:
        raise InputError(f'{path}: cannot be written ({error.strerror or error})') from error


@contextmanager
def progress(title: str, total: float) -> Iterator[Callable[[float], None]]:
    """Show a progress bar with time left on standard error; yields `done(amount so far)`.

    Nothing is drawn where standard error is no terminal.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    bar = Progress(
        TextColumn('{task.description}'),
        BarColumn(),
        TextColumn('{task.percentage:>3.0f} %'),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    with bar:
        task = bar.add_task(title, total=total)
        yield lambda amount: bar.update(task, completed=amount)
