"""Run the paper's complete study and report every figure and table beside the published values."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from actuator_glue.cli._output import note, say, write_json
from actuator_glue.cli._parser import Folder, add_force


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        '--out',
        type=Folder,
        default='out/reproduce',
        metavar='DIR',
        help='folder for report.html, results.json and curves/*.csv (default: %(default)s)',
    )
    add_force(parser)
    parser.add_argument(
        '--quick', action='store_true', help='under a minute: fewer evaluations, three G of eight'
    )
    parser.add_argument(
        '--seed', type=int, default=1, help='of sensor noise and samplers (default: %(default)s)'
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Write the report; 0 when done.

    Raises:
        InputError: the folder cannot be written or the seed is negative.
    """
    from actuator_glue.errors import InputError
    from actuator_glue.reproduction import as_csv, as_json, report
    from actuator_glue.reproduction.study import study

    if args.seed < 0:
        raise InputError(f'--seed {args.seed} is negative; give 0 or more')
    out = Path(args.out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f'--out {out}: cannot be made ({error.strerror or error})') from error
    started = time.monotonic()
    with _progress() as tell:
        # Figures and files are the last tenth.
        results = study(
            args.seed, quick=args.quick, progress=lambda stage, share: tell(stage, 0.9 * share)
        )
        tell('figures and report', 0.9)
        made = f'actuator-glue reproduce{" --quick" if args.quick else ""} --seed {args.seed}'
        page = report.write(results, out / 'report.html', made=made)
        tell('files', 0.97)
        numbers = out / 'results.json'
        write_json(as_json.to_json(results), str(numbers))
        curves = as_csv.write(results, out / 'curves')
        tell('done', 1.0)
    note(f'{time.monotonic() - started:.0f} s')
    spread = results.table_4
    say(f'report    {page}', args)
    say(f'numbers   {numbers}', args)
    say(f'curves    {out / "curves"} ({len(curves)} files)', args)
    say(
        f'Table 4   matched at a residual of {1e3 * spread.matched.best_rms:.2f} mm rms; COVs of '
        'beta_1, alpha_1_beta_0, alpha_2 off by '
        + ', '.join(f'{100 * d:+.0f} %' for d in spread.difference[:3]),
        args,
    )
    return 0


@contextmanager
def _progress() -> Iterator[Callable[[str, float], None]]:
    """Show stage, bar and time left; where standard error is no terminal, one line per stage."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    bar = Progress(
        TextColumn('{task.description:<38}'),
        BarColumn(),
        TextColumn('{task.percentage:3.0f} %'),
        TimeElapsedColumn(),
        TextColumn('left'),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )
    last = ''
    with bar:
        task = bar.add_task('starting', total=1.0)

        def tell(stage: str, share: float) -> None:
            nonlocal last
            bar.update(task, description=stage, completed=share)
            if stage != last and not console.is_terminal:
                note(f'{100 * share:.0f} % {stage}')
            last = stage

        yield tell
