"""How much two workers do more than one, in turns over the same records.

`python -m benchmarks.laboratory.worker_counts --records 60 --turns 3`. Nothing is diagnosed, so
that groups take alike. Rows are compared to the bit. Writes worker_counts.json and .md.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import time
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import actuator_glue as ag
from actuator_glue.campaigns.recipe import read_recipe
from benchmarks.laboratory.simulate import simulate

if TYPE_CHECKING:
    from pandas import DataFrame

COUNTS = (1, 2)
# What tells how and when, and no number of a record.
_OF_THE_RUN = ('seconds', 'finished')


def main() -> int:
    """Run in turns, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--records', type=int, default=60, help='of all four machines')
    parser.add_argument('--turns', type=int, default=3, help='each with one worker and with two')
    parser.add_argument('--seed', type=int, default=2, help='of the laboratory')
    parser.add_argument('--out', type=Path, default=Path('out/worker_counts'), help='folder')
    args = parser.parse_args()
    shutil.rmtree(args.out, ignore_errors=True)
    args.out.mkdir(parents=True)
    simulate(args.out, args.records, 15.0, args.seed)
    recipe = replace(read_recipe(args.out / 'recipe.yaml'), diagnose='never')
    runs: list[dict[str, Any]] = []
    first: DataFrame | None = None
    for turn in range(args.turns):
        for count in COUNTS:
            before, began = _processor(), time.perf_counter()
            folder = args.out / f'{turn}_{count}'
            table = ag.campaign(args.out / 'records', folder, recipe, workers=count).table
            wall = time.perf_counter() - began
            after = _processor()
            numbers = table.sort_values('group').drop(columns=list(_OF_THE_RUN)).reset_index()
            first = numbers if first is None else first
            runs.append(
                {
                    'turn': turn,
                    'workers': count,
                    'groups': len(table),
                    'seconds': wall,
                    'groups_per_hour': _pace(table),
                    'busy_seconds': float(table['seconds'].sum()),
                    'machine_busy': (after[0] - before[0]) / (after[1] - before[1]),
                    'load': os.getloadavg()[0],
                    'same_rows': bool(numbers.equals(first)),
                }
            )
    (args.out / 'worker_counts.json').write_text(json.dumps(runs, indent=1) + '\n')
    told = text(runs)
    (args.out / 'worker_counts.md').write_text(told)
    print(told)
    return 0


def _pace(table: DataFrame) -> float:
    """Return groups an hour from the first row on: how long processes start is no part of it."""
    ends = sorted(datetime.fromisoformat(t).timestamp() for t in table['finished'])
    return 3600.0 * (len(ends) - 1) / (ends[-1] - ends[0])


def _processor() -> tuple[float, float]:
    """Return what the machine's processors have worked, and could have, since it was started."""
    line = Path('/proc/stat').read_text('utf-8').splitlines()[0].split()[1:9]
    ticks = [float(t) for t in line]  # user nice system idle iowait irq softirq steal
    return sum(ticks) - ticks[3] - ticks[4], sum(ticks)


def text(runs: list[dict[str, Any]]) -> str:
    """Return the turns as a table of Markdown, and the efficiency of two workers."""
    one, two = (
        float(np.median([r['groups_per_hour'] for r in runs if r['workers'] == n])) for n in COUNTS
    )
    same = all(r['same_rows'] for r in runs)
    lines = [
        f'Efficiency of two workers: {two / (2.0 * one):.2f} ({one:.0f} and {two:.0f} groups an '
        f'hour, medians). Rows are {"alike to the bit" if same else "NOT ALIKE"}.',
        '',
        '| turn | workers | groups | s | groups an hour | worker s | processors busy | load |',
        '|---|---|---|---|---|---|---|---|',
    ]
    for r in runs:
        cells = (
            r['turn'] + 1,
            r['workers'],
            r['groups'],
            f'{r["seconds"]:.0f}',
            f'{r["groups_per_hour"]:.0f}',
            f'{r["busy_seconds"]:.0f}',
            f'{100.0 * r["machine_busy"]:.0f} %',
            f'{r["load"]:.1f}',
        )
        lines.append(f'| {" | ".join(map(str, cells))} |')
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    raise SystemExit(main())
