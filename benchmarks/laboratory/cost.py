"""What a million records cost, from what was measured, and where more cores stop helping.

`python -m benchmarks.laboratory.cost LABORATORY.json TINY_TASKS.json --groups 1000000`.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

CORES = (1, 16, 64, 256, 1024)


def text(laboratory: dict, tiny: list[dict], groups: int) -> str:
    """Return the cost as Markdown.

    Args:
        laboratory: scores of `benchmarks.laboratory`.
        tiny: samples of `benchmarks.laboratory.tiny_tasks`.
        groups: of records.
    """
    during = [s for s in tiny if s['tasks']]
    first, last = during[0], during[-1]
    tasks = last['tasks'] - first['tasks']
    # One process each: what it takes of a processor bounds how many tasks it hands out.
    hand_out = max((last[f'{n}_cpu'] - first[f'{n}_cpu']) / tasks for n in ('client', 'scheduler'))
    busy = laboratory['run']['busy_hours'] * 3600.0 / laboratory['groups']
    most = busy / hand_out
    lines = [
        f'{groups} groups at {busy:.1f} s are {groups * busy / 3600.0:.0f} core-hours. Client or '
        f'scheduler take {1e3 * hand_out:.1f} ms of a processor a task: beyond {most:.0f} cores '
        'they hold the others up.',
        '',
        '| cores | hours |',
        '|---|---|',
    ]
    for cores in CORES:
        hours = groups * max(busy / cores, hand_out) / 3600.0
        lines.append(f'| {cores} | {hours:.1f} |')
    return '\n'.join(lines) + '\n'


def main() -> int:
    """Print the cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('laboratory', type=Path, help='laboratory.json')
    parser.add_argument('tiny', type=Path, help='tiny_tasks.json')
    parser.add_argument('--groups', type=int, default=1_000_000, help='groups of records')
    args = parser.parse_args()
    found = (json.loads(p.read_text('utf-8')) for p in (args.laboratory, args.tiny))
    print(text(*found, args.groups))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
