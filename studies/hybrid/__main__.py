"""Predict the stability of simulated actuators from pre-tests, and run each one's hybrid test."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np

from actuator_glue.arguments import Folder, claim_outputs
from actuator_glue.errors import InputError
from studies.hybrid import library
from studies.hybrid.figure import reliability_figure
from studies.hybrid.findings import Findings, findings
from studies.hybrid.trial import Outcome, trial

MADE = ('results.json', 'reliability.png')


def parser() -> argparse.ArgumentParser:
    """Return the command line."""
    found = argparse.ArgumentParser(prog='python -m studies.hybrid', description=__doc__)
    found.add_argument(
        '--out',
        type=Folder,
        default='out/study-rths',
        metavar='DIR',
        help='folder for results.json and reliability.png (default: %(default)s)',
    )
    found.add_argument('--force', action='store_true', help='replace an earlier run')
    found.add_argument(
        '--actuators',
        type=int,
        default=300,
        metavar='N',
        help='how many; each takes about 10 CPU seconds (default: %(default)s)',
    )
    return found


def write(outcomes: list[Outcome], found: Findings, out: Path) -> None:
    """Write numbers and figure."""
    content = {
        'schema': 'studies.hybrid/1',
        **asdict(found),
        'actuators': [asdict(one) for one in outcomes],
    }
    library.write_json(content, str(out / MADE[0]))
    reliability_figure(outcomes, found).savefig(out / MADE[1])


def main(argv: list[str] | None = None) -> int:
    """Run the study; return the exit code."""
    args = parser().parse_args(argv)
    out = Path(args.out)
    try:
        if args.actuators < 1:
            raise InputError(f'--actuators {args.actuators}: at least one is needed')
        claim_outputs(args)
        out.mkdir(parents=True, exist_ok=True)
        outcomes = []
        for seed in range(1, args.actuators + 1):
            outcomes.append(trial(seed))
            last = outcomes[-1]
            print(
                f'{seed}: P(unstable) = {last.predicted:.3f}, '
                f'{"unstable" if last.unstable else "stable"}, '
                f'{100 * last.inside:.0f} % of the response in its band',
                flush=True,
            )
        found = findings(outcomes)
        write(outcomes, found, out)
    except InputError as error:
        print(f'error: {error}', file=sys.stderr)
        return 2
    print(found.text())
    return 0


if __name__ == '__main__':
    np.seterr(all='ignore')
    sys.exit(main())
