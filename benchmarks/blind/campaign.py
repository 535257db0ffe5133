"""Blind benchmark of the diagnosis: `python benchmarks/blind/campaign.py --cases 60 --jobs 1`.

Every case is built from its seed, diagnosed without its truth, cached in the output folder and
scored at the end; an interrupted run goes on where it stopped. Seeds 0-999 are for calibration,
1000 and up for reporting.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from importlib import import_module
from pathlib import Path
from typing import Any

# Cases run side by side; threads of the linear algebra would only wait for each other.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
sys.path.insert(0, str(HERE.parents[1]))


def commit() -> str:
    """Return the commit of this checkout; with `-dirty` where files differ from it."""
    command = ['git', '-C', str(HERE), 'describe', '--always', '--dirty', '--exclude', '*']
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip() or 'unknown'


def one(
    seed: int, cache: Path, generator: str, options: dict[str, Any], threads: int = 1
) -> dict[str, Any]:
    """Build, diagnose and cache one case; options are those of the generator."""
    path = cache / f'{seed}.json'
    if path.exists():
        return dict(json.loads(path.read_text()))
    import time_left
    import truth

    from actuator_glue.diagnosis.diagnose import diagnose
    from actuator_glue.model.parameters import NAMES
    from actuator_glue.records import Record

    case = import_module(generator).build(seed, **options)
    names = ('first', 'second', 'held')
    rows = zip(case.commands, case.measured, case.stiffness, names, strict=True)
    records = [Record(u, y, 1.0 / case.rate, stiffness=k, source=s) for u, y, k, s in rows]
    shown: list[tuple[float, float]] = []
    with ThreadPoolExecutor(threads) as pool:
        start, busy = time.perf_counter(), time.process_time()

        def told(stage: str, share: float) -> None:
            shown.append((time.perf_counter() - start, share))

        found = diagnose(records[:2], records[2], seed=seed, each=pool.map, progress=told)
        seconds, busy = time.perf_counter() - start, time.process_time() - busy
    result = {
        'seed': seed,
        'kind': case.kind,
        'effects': list(case.effects),
        'sizes': case.sizes,
        'ratio': case.ratio,
        'shares': case.shares,
        'parameters': dict(zip(NAMES, map(float, case.theta), strict=True)) | case.parameters,
        'colour': case.colour,
        'stiffness': [float(k) for k in case.stiffness],
        'seconds': seconds,
        'processor_seconds': busy,
        'threads': threads,
        'told_in_time': time_left.told_in_time(shown, seconds),
        'commit': commit(),
        'generator': generator,
        'true_structure_error': truth.refitted(case, records),
        'clean_floor': truth.floor(case),
        'diagnosis': found.to_json(),
    }
    cache.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix('.part')
    partial.write_text(json.dumps(result))
    partial.rename(path)
    return result


def main() -> int:
    """Run the cases that are not cached, then print and write the scores."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--cases', type=int, default=60)
    parser.add_argument(
        '--first', type=int, default=1000, help='first seed (below 1000: calibration)'
    )
    parser.add_argument('--jobs', type=int, default=1, help='machines at a time')
    parser.add_argument('--threads', type=int, default=1, help='threads of each diagnosis')
    parser.add_argument(
        '--generator',
        choices=('cases', 'variant', 'mixed', 'far'),
        default='cases',
        help='cases: one effect on one test; variant: other forms, other tests; mixed: several '
        'effects, spikes, onsets; far: machines and tests of any scale',
    )
    parser.add_argument(
        '--effects',
        nargs='+',
        default=[],
        help='machines of `variant` with these effects instead of those that the seeds draw',
    )
    parser.add_argument('--bare', action='store_true', help='those machines have no specimen')
    parser.add_argument('--out', type=Path, default=Path('out/blind'))
    args = parser.parse_args()
    seeds = range(args.first, args.first + args.cases)
    generator = args.generator
    out = args.out if generator == 'cases' else args.out / generator
    options: dict[str, Any] = {}
    if args.effects:
        options['asked'] = tuple(args.effects)
        out /= '+'.join(args.effects)
    if args.bare:
        options['stiffness'] = (0.0, 0.0, 0.0)
        out /= 'bare'
    results = []
    with ProcessPoolExecutor(args.jobs) as pool:
        futures = [
            pool.submit(one, seed, out / 'cases', generator, options, args.threads)
            for seed in seeds
        ]
        for i, future in enumerate(as_completed(futures)):
            result = future.result()
            results.append(result)
            d = result['diagnosis']
            names = ['|'.join([e['name'], *e['alternatives']]) for e in d['effects']]
            print(
                f'[{i + 1}/{args.cases}] {result["seed"]} {result["kind"]} '
                f'{"+".join(result["effects"]) or "-"} x{result["ratio"]:.1f} -> '
                f'{d["verdict"]} {" + ".join(names)} ({result["seconds"]:.0f} s)',
                flush=True,
            )
    import score

    summary = score.scores(results)
    print(score.table(summary))
    out.mkdir(parents=True, exist_ok=True)
    (out / 'blind.json').write_text(json.dumps(summary, indent=1))
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
