"""Progress of a long call: a bar in a notebook by itself, one in a terminal where it is asked for.

In a notebook it is a line of HTML that is written anew, which needs nothing but what shows the
notebook, and is gone at the end.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from actuator_glue.api.callbacks import harmless

_EVERY = 0.2  # s between two looks
_AN_HOUR = 3600.0  # s


def in_notebook() -> bool:
    """Whether a kernel that shows HTML runs this."""
    shell = sys.modules.get('IPython')
    if shell is None:
        return False
    return hasattr(shell.get_ipython(), 'kernel')


@contextmanager
def shown(
    title: str, total: float, asked: Callable[[float], object] | bool | None
) -> Iterator[Callable[[float], None]]:
    """Show how much is done; yields `done(amount so far)`.

    Args:
        title: what is under way.
        total: amount at the end.
        asked: True for a bar wherever this runs, False for none, None for one in a notebook; a
            function is called instead, until it fails.
    """
    if callable(asked):
        yield harmless(asked)
    elif asked is False or (asked is None and not in_notebook()):
        yield lambda amount: None
    elif in_notebook():
        line = _Line(title, total)
        try:
            yield harmless(line)
        finally:
            line.clear()
    else:
        with progress(title, total) as done:
            yield done


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
        speed_estimate_period=_AN_HOUR,  # shares are of the whole, so the time left is, too
    )
    with bar:
        task = bar.add_task(title, total=total)
        yield lambda amount: bar.update(task, completed=amount)


class _Line:
    """A bar in a notebook with time left."""

    def __init__(self, title: str, total: float) -> None:
        notebook: Any = import_module('IPython.display')  # it is there, and no dependency
        self._html = notebook.HTML
        self._title, self._total = title, total
        self._begin = self._last = time.monotonic()
        self._handle = notebook.display(self._html(self._text(0.0)), display_id=True)

    def __call__(self, amount: float) -> None:
        """Show how much is done."""
        now = time.monotonic()
        if now - self._last >= _EVERY:
            self._last = now
            self._handle.update(self._html(self._text(min(amount / self._total, 1.0))))

    def clear(self) -> None:
        """Take the bar away."""
        self._handle.update(self._html(''))

    def _text(self, share: float) -> str:
        passed = time.monotonic() - self._begin
        left = f', {passed * (1.0 - share) / share:.0f} s left' if share > 0.02 else ''
        return (
            f'<label>{self._title} <progress max="1" value="{share:.3f}"></progress> '
            f'{100.0 * share:.0f} %{left}</label>'
        )
