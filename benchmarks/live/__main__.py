"""Run streams through the live loop and write what came of each, and of all.

A run that was stopped goes on where it was, with the same commit.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from actuator_glue.arguments import Folder
from actuator_glue.online.when_to_diagnose import LiveSettings
from benchmarks.live.cases import Case, NotBuiltError, all_cases, few, streamed
from benchmarks.live.chain import chain
from benchmarks.live.score import scored
from benchmarks.live.table import page


def one(case: Case) -> dict[str, Any]:
    """Run one case; return its row."""
    began = time.perf_counter()
    given = streamed(case)
    ran = chain(given.record, given.carried, LiveSettings(apply=True), seed=case.seed)
    row = asdict(case) | scored(case, given, ran)
    return row | {'seconds': time.perf_counter() - began, 'said': ran.said}


def _rows(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text().splitlines()]


def commit() -> str:
    """Return the commit that is run; empty outside a repository."""
    command = ['git', 'describe', '--always', '--dirty', '--abbrev=10']
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def ran(cases: Sequence[Case], jobs: int, minutes: float) -> Iterator[dict[str, Any]]:
    """Yield rows as they come; none is begun later than so many minutes after the start."""
    end = time.monotonic() + 60.0 * minutes
    left = list(reversed(cases))
    with ProcessPoolExecutor(jobs) as pool:
        running = {pool.submit(one, left.pop()) for _ in range(min(jobs, len(left)))}
        while running:
            done = next(as_completed(running))
            running.remove(done)
            if left and time.monotonic() < end:
                running.add(pool.submit(one, left.pop()))
            try:
                yield done.result()
            except NotBuiltError as error:
                # One whose effect cannot be as large as is wanted: said, and left out.
                print(f'left out: {error}', file=sys.stderr)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.live', description=__doc__)
    parser.add_argument('--out', type=Folder, default='out/live')
    parser.add_argument('--few', action='store_true', help='each effect once, two healthy ones')
    parser.add_argument('--seconds', type=float, default=120.0, help='of each of the few')
    parser.add_argument('--seed', type=int, default=1000)
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument(
        '--minutes',
        type=float,
        default=float('inf'),
        help='begin no further stream after that; they come in an order drawn by the seed, so '
        'that those that were run are a fair sample of all',
    )
    parser.add_argument('--hidden', metavar='NAME', help='only streams that hide it, or nothing')
    parser.add_argument(
        '--page', type=Path, metavar='FILE.md', help='write the page of rows in --out; run nothing'
    )
    parser.add_argument(
        '--before', type=Path, metavar='DIR', help='rows of an earlier commit, told beside'
    )
    args = parser.parse_args(argv)
    folder = Path(args.out)
    file = folder / 'streams.jsonl'
    cases = few(args.seed, args.seconds) if args.few else all_cases(args.seed)
    if args.page is not None:
        before = [] if args.before is None else _rows(args.before / 'streams.jsonl')
        args.page.write_text(page(_rows(file), len(cases), before))
        return 0
    if args.hidden is not None:
        wanted = () if args.hidden == 'nothing' else tuple(args.hidden.split('+'))
        cases = [case for case in cases if case.effects == wanted]
    cases = [cases[i] for i in np.random.default_rng(args.seed).permutation(len(cases))]
    folder.mkdir(parents=True, exist_ok=True)
    at = commit()
    rows = _rows(file) if file.exists() else []
    others = {row['commit'] for row in rows} - {at}
    if others:
        parser.error(f'{file} has streams of {", ".join(sorted(others))}, and this is {at}')
    had = {row['seed'] for row in rows}
    with file.open('a') as lines:
        for row in ran([case for case in cases if case.seed not in had], args.jobs, args.minutes):
            rows.append(row | {'commit': at})
            lines.write(json.dumps(rows[-1]) + '\n')
            lines.flush()
    print(page(rows, len(cases)))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
