"""A simulated laboratory, its campaign, and scores beside the truth.

`python -m benchmarks.laboratory --records 2000 --out out/laboratory`. A run that was stopped goes
on. Writes laboratory.json and laboratory.md.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

import actuator_glue as ag
from actuator_glue.campaigns.rows import read_results
from benchmarks.laboratory.judge import judge, text
from benchmarks.laboratory.simulate import simulate


def main() -> int:
    """Simulate what is not there, run or go on, judge, write."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.laboratory', description=__doc__)
    parser.add_argument('--records', type=int, default=2000, help='of all four machines')
    parser.add_argument('--seconds', type=float, default=15.0, help='length of a record')
    parser.add_argument('--seed', type=int, default=1, help='of the laboratory')
    parser.add_argument('--workers', type=int, default=None, help='of the campaign')
    parser.add_argument('--with-prior', type=int, default=12, help='tests calibrated with a prior')
    parser.add_argument('--judge', action='store_true', help='of what is there, run nothing')
    parser.add_argument('--out', type=Path, default=Path('out/laboratory'), help='folder')
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    if not (args.out / 'truth.json').exists():
        simulate(args.out, args.records, args.seconds, args.seed)
    if not args.judge:
        ag.campaign(
            args.out / 'records',
            args.out / 'out',
            args.out / 'recipe.yaml',
            workers=args.workers,
            progress=lambda now: print(now.line(now.updated), flush=True),
        )
    table = read_results(args.out / 'out')
    scores = judge(args.out, args.with_prior)
    # Of what workers computed, whatever interruptions lay between.
    hours = float(table['seconds'].sum()) / 3600.0
    how = {
        'cores': os.cpu_count(),
        'busy_hours': hours,
        'groups_per_hour': len(table) / hours,
        'records_per_hour': scores['records'] / hours,
        'version': ag.__version__,
    }
    (args.out / 'laboratory.json').write_text(json.dumps({'run': how, **scores}, indent=1) + '\n')
    table_text = text(scores, how)
    (args.out / 'laboratory.md').write_text(table_text)
    print(table_text)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
