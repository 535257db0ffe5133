"""Run streams through the live loop and write what came of each, and of all."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any

from actuator_glue.arguments import Folder
from actuator_glue.online.live_diagnosis import LiveSettings
from benchmarks.live.cases import Case, all_cases, few, streamed
from benchmarks.live.chain import chain
from benchmarks.live.score import scored, table


def one(case: Case) -> dict[str, Any]:
    """Run one case; return its row."""
    began = time.perf_counter()
    given = streamed(case)
    ran = chain(given.record, given.carried, LiveSettings(apply=True), seed=case.seed)
    row = asdict(case) | scored(case, given, ran)
    return row | {'seconds': time.perf_counter() - began, 'said': ran.said}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks.live', description=__doc__)
    parser.add_argument('--out', type=Folder, default='out/live')
    parser.add_argument('--few', action='store_true', help='each effect once, two healthy ones')
    parser.add_argument('--seconds', type=float, default=120.0, help='of each of the few')
    parser.add_argument('--seed', type=int, default=1000)
    parser.add_argument('--jobs', type=int, default=1)
    args = parser.parse_args(argv)
    cases = few(args.seed, args.seconds) if args.few else all_cases(args.seed)
    folder = Path(args.out)
    folder.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []
    with (folder / 'streams.jsonl').open('w') as file, ProcessPoolExecutor(args.jobs) as pool:
        for done in as_completed([pool.submit(one, case) for case in cases]):
            rows.append(done.result())
            file.write(json.dumps(rows[-1]) + '\n')
            file.flush()
    text = table(rows)
    (folder / 'streams.md').write_text(text)
    print(text)
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
