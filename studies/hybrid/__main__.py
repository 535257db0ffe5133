"""Predict the stability of simulated actuators from pre-tests, and run each one's hybrid test.

Stopped, it is gone on with by the same command: each actuator is noted when it is done.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path
from shutil import copy

import numpy as np

from actuator_glue.errors import InputError
from studies.hybrid import library, outcomes
from studies.hybrid.figure import reliability_figure
from studies.hybrid.judgement import Findings, findings
from studies.hybrid.page import write_between
from studies.hybrid.trial import Outcome, design

KEPT, NUMBERS, PICTURE = 'outcomes.jsonl', 'results.json', 'reliability.png'


def parser() -> argparse.ArgumentParser:
    """Return the command line."""
    found = argparse.ArgumentParser(prog='python -m studies.hybrid', description=__doc__)
    found.add_argument(
        '--out',
        default='out/study-rths',
        metavar='DIR',
        help=f'folder for {KEPT}, {NUMBERS} and {PICTURE} (default: %(default)s)',
    )
    found.add_argument('--force', action='store_true', help='begin anew')
    found.add_argument(
        '--actuators', type=int, default=300, metavar='N', help='how many (default: %(default)s)'
    )
    found.add_argument(
        '--workers', type=int, default=1, metavar='N', help='processes (default: %(default)s)'
    )
    found.add_argument(
        '--page',
        type=Path,
        metavar='FILE.md',
        help='also write table and picture into this page (docs/rths_study.md)',
    )
    return found


def write(done: list[Outcome], found: Findings, out: Path) -> None:
    """Write numbers and figure."""
    content = {
        'schema': 'studies.hybrid/2',
        'design': design(),
        **asdict(found),
        'actuators': [asdict(one) for one in done],
    }
    library.write_json(content, str(out / NUMBERS))
    library.style.save(reliability_figure(done, found), out / PICTURE)


def main(argv: list[str] | None = None) -> int:
    """Run the study; return 0 where the predictions hold, 1 where they do not."""
    args = parser().parse_args(argv)
    out = Path(args.out)
    try:
        if args.actuators < 1 or args.workers < 1:
            raise InputError('--actuators and --workers: at least one of each is needed')
        out.mkdir(parents=True, exist_ok=True)
        if args.force:
            (out / KEPT).unlink(missing_ok=True)
        kept = outcomes.Outcomes(out / KEPT)
        wanted = range(1, args.actuators + 1)
        for one in outcomes.made([s for s in wanted if s not in kept.known], args.workers):
            kept.add(one)
            response = (
                'diverged' if one.inside is None else f'{100 * one.inside:.0f} % in its band'
            )
            print(
                f'{one.seed}: P(unstable) = {one.predicted:.3f}, '
                f'{"unstable" if one.unstable else "stable"}, response {response}',
                flush=True,
            )
        done = [kept.known[seed] for seed in wanted]
        found = findings(done)
        write(done, found, out)
        if args.page is not None:
            write_between(args.page, 'study', found.table())
            copy(out / PICTURE, args.page.parent / 'images' / 'rths_reliability.png')
    except (InputError, OSError) as error:
        print(f'error: {error}', file=sys.stderr)
        return 2
    print(found.text())
    return 0 if found.reliable and found.covered else 1


if __name__ == '__main__':
    np.seterr(all='ignore')
    sys.exit(main())
