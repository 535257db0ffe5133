"""Live progress in the terminal; a line now and then where there is no terminal."""

from __future__ import annotations

from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from examples.demonstration.watch import Watch

LINE_SECONDS = 10.0  # between two lines where there is no terminal


class Display:
    """A bar per stage and, below it, what the estimator says.

    Args:
        console: where to show it.
    """

    def __init__(self, console: Console) -> None:
        self.console = console
        self._bar = Progress(
            TextColumn('{task.description:<37}'),
            BarColumn(),
            TaskProgressColumn(),
            TimeRemainingColumn(),
            console=console,
        )
        self._live = Live(self._bar, console=console, refresh_per_second=4)
        self._next_line = 0.0

    def __enter__(self) -> Self:
        if self.console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self._live.stop()

    def stage(self, name: str, total: float = 1.0) -> TaskID:
        """Begin a stage of `total` steps; return its number for `advance`."""
        if not self.console.is_terminal:
            self.console.print(name)
            self._next_line = LINE_SECONDS
        return self._bar.add_task(name, total=total)

    def advance(self, stage: TaskID, done: float) -> None:
        """Set how much of a stage is done."""
        self._bar.update(stage, completed=done)

    def show(self, watch: Watch, elapsed: float) -> None:
        """Show what has been recorded so far; `elapsed` [s] since the start."""
        if self.console.is_terminal:
            self._live.update(Group(self._bar, _table(watch)))
        elif elapsed >= self._next_line:
            self._next_line += LINE_SECONDS
            self.console.print(f'  {elapsed:5.0f} s  {_line(watch)}')


def _line(watch: Watch) -> str:
    parts = [f'{watch.samples} samples recorded, {watch.windows} windows']
    if watch.posterior is not None:
        p = watch.posterior
        parts.append(f'beta_1 {p.beta_1_mean:.1f} +- {p.beta_1_stddev:.1f} 1/s')
        parts.append(f'R-hat {p.rhat_max:.3f}')
    if watch.coverages:
        parts.append(
            f'forecast {watch.forecast.widest_level:.0%} band held {watch.coverages[-1]:.1%}'
        )
    return ', '.join(parts)


def _table(watch: Watch) -> Table:
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(justify='right', style='bold')
    table.add_column()
    table.add_row('recorded', f'{watch.samples} samples, {watch.windows} windows')
    p = watch.posterior
    if p is not None:
        for name, unit, mean, stddev in zip(
            p.parameter_names, p.units, p.mean, p.stddev, strict=True
        ):
            table.add_row(name, f'{mean:.4g} +- {stddev:.2g} {unit}')
        table.add_row('R-hat', f'{p.rhat_max:.3f} after {p.evaluations} evaluations')
        table.add_row('', f'{p.seconds * 1e3:.0f} ms, residual {p.rms_error * 1e6:.1f} um rms')
    if watch.forecast is not None:
        band = watch.forecast
        table.add_row(
            'forecast',
            f'{band.widest_level:.0%} band held {band.widest_coverage:.1%} of its samples, '
            f'{band.widest_width * 1e6:.0f} um wide',
        )
    return table
