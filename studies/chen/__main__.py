"""Run the paper's complete study and report every figure and table beside the published values."""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from actuator_glue import __version__
from actuator_glue.arguments import Folder, claim_outputs
from actuator_glue.errors import InputError
from actuator_glue.io.json_file import write_json
from studies.chen import published, report
from studies.chen.curves import curves
from studies.chen.library import NOISE
from studies.chen.responses import LEVEL
from studies.chen.study import Results, study
from studies.chen.table import write_curve
from studies.chen.tables import TABLES

SCHEMA = 'studies.chen/1'
MADE = ('report.html', 'results.json', 'tables', 'curves')  # what a run puts into its folder


def parser() -> argparse.ArgumentParser:
    """Return the command line."""
    found = argparse.ArgumentParser(prog='python -m studies.chen', description=__doc__)
    found.add_argument(
        '--out',
        type=Folder,
        default='out/reproduce',
        metavar='DIR',
        help='folder for report.html, results.json, tables/*.csv and curves/*.csv '
        '(default: %(default)s)',
    )
    found.add_argument(
        '--force', action='store_true', help='replace the results of an earlier run'
    )
    found.add_argument(
        '--quick', action='store_true', help='about a minute: fewer evaluations, three G of eight'
    )
    found.add_argument(
        '--seed', type=int, default=1, help='of sensor noise and samplers (default: %(default)s)'
    )
    return found


def write(results: Results, out: Path, made: str) -> int:
    """Write report, numbers, tables and curves; return how many CSV files.

    Args:
        results: of the study.
        out: folder; what an earlier run left there is replaced.
        made: the command that made them.
    """
    for name in MADE:
        if (out / name).is_dir():
            shutil.rmtree(out / name)
    tables = {name: table(results) for name, table in TABLES.items()}
    drawn = curves(results)
    for folder in ('tables', 'curves'):
        (out / folder).mkdir()
    for name, table in tables.items():
        table.write(out / 'tables' / f'{name}.csv')
    for name, curve in drawn.items():
        write_curve(out / 'curves' / f'{name}.csv', curve)
    numbers = {
        'schema': SCHEMA,
        'version': __version__,
        'source': published.SOURCE,
        'seed': results.seed,
        'quick': results.quick,
        'sensor_noise': NOISE,
        'level': LEVEL,
        'tables': {name: table.records() for name, table in tables.items()},
        'diagnosis': {name: found.to_json() for name, found in results.diagnoses.items()},
    }
    write_json(numbers, str(out / 'results.json'))
    report.write(results, out / 'report.html', made=made)
    return len(tables) + len(drawn)


def run(args: argparse.Namespace) -> None:
    """Run the study and write its results.

    Raises:
        InputError: the folder cannot be written, holds results, or the seed is negative.
    """
    if args.seed < 0:
        raise InputError(f'--seed {args.seed} is negative; give 0 or more')
    claim_outputs(args)
    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    started = time.monotonic()
    made = f'python -m studies.chen{" --quick" if args.quick else ""} --seed {args.seed}'
    with progress() as tell:
        # Figures and files are the last tenth.
        results = study(
            args.seed, quick=args.quick, progress=lambda stage, share: tell(stage, 0.9 * share)
        )
        tell('figures and files', 0.9)
        files = write(results, out, made)
        tell('done', 1.0)
    print(f'{time.monotonic() - started:.0f} s', file=sys.stderr)
    print(f'report    {out / "report.html"}')
    print(f'numbers   {out / "results.json"}')
    print(f'CSV       {out / "tables"}, {out / "curves"} ({files} files)')
    spread = results.table_4
    print(
        f'Table 4   matched at a residual of {1e3 * spread.matched.best_rms:.2f} mm rms; COVs of '
        'beta_1, alpha_1_beta_0, alpha_2 off by '
        + ', '.join(f'{100 * d:+.0f} %' for d in spread.off('cov')[:3])
    )


@contextmanager
def progress() -> Iterator[Callable[[str, float], None]]:
    """Show stage, bar and time left; where standard error is no terminal, one line per stage."""
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
                print(f'{100 * share:.0f} % {stage}', file=sys.stderr)
            last = stage

        yield tell


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command: 0 when done, 2 where the input cannot be used."""
    try:
        run(parser().parse_args(argv))
    except (InputError, OSError) as error:
        print(f'studies.chen: {error}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print('studies.chen: interrupted', file=sys.stderr)
        return 130
    return 0


if __name__ == '__main__':
    sys.exit(main())
