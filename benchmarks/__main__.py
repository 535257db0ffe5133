"""Everything side by side: `make bench`, or `python -m benchmarks --out FOLDER [--only PART ..]`.

Whether a computer keeps its deadlines for ten minutes says
`make bench BENCH_ARGS='--only online --seconds 600'`.

Writes bench.json (schema actuator_glue.bench/1), bench.md and bench.png.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.environment import ROOT, python
from examples.demonstration.processes import end_in_order

PEERS = ('emcee_samplers', 'pydream_sampler', 'spotpy_sampler', 'pints_samplers')


def _isolated(interpreter: Path | str, *arguments: str, timeout: float = 1800.0) -> None:
    """Run a module in a process of its own, so that nothing it loads or pins stays."""
    subprocess.run(
        [str(interpreter), '-m', *arguments],
        cwd=ROOT,
        check=True,
        timeout=timeout,
        env={**os.environ, 'PYTHONPATH': str(ROOT)},
        capture_output=True,
        text=True,
    )


def problem_r(out: Path) -> dict[str, Any]:
    """This project before and after the peers, so that a machine that slows down slows both."""
    import numpy as np

    from benchmarks import sampler

    np.save(out / 'posterior.npy', sampler.history())
    # In the environment that this runs in, but on one core and from its own start.
    runs = []

    def ours() -> None:
        _isolated(sys.executable, 'benchmarks.sampler', str(out / 'ours.json'))
        runs.append(json.loads((out / 'ours.json').read_text()))

    interpreter = python(out / 'peers-venv')
    ours()
    peers: dict[str, Any] = {}
    for module in PEERS:
        print(f'  {module}', flush=True)
        result = out / f'{module}.json'
        try:
            _isolated(
                interpreter, 'benchmarks.peers', module, str(out / 'posterior.npy'), str(result)
            )
            peers |= json.loads(result.read_text())
        except subprocess.CalledProcessError as error:
            peers[module] = {'error': (error.stderr or '').strip().splitlines()[-1:]}
        except subprocess.TimeoutExpired:
            peers[module] = {'error': ['took more than half an hour']}
    ours()
    lower = min(runs, key=lambda run: run['ess_per_second'])
    best_peer = max(
        (p['ess_per_second'] for p in peers.values() if 'error' not in p), default=None
    )
    return {
        'ours': lower,
        'ours_runs_ess_per_second': [run['ess_per_second'] for run in runs],
        'peers': peers,
        'ratio_to_best_peer': lower['ess_per_second'] / best_peer if best_peer else None,
    }


def likelihood(out: Path) -> dict[str, Any]:
    """Fast path, exact kernel and lfilter."""
    from benchmarks import likelihood as bench

    lengths = bench.cost_against_length((6.0, 20.0, 60.0, 200.0, 600.0))
    return {**bench.run(), 'against_length': lengths}


def kernel(out: Path) -> dict[str, Any]:
    """Exact simulation, linear and with effects."""
    from benchmarks import effects

    rows, each = effects.run(), effects.each()
    found: dict[str, Any] = {
        'against_effects': rows,
        'each_effect': each,
        'expressions': effects.written(),
    }
    for which in ('ns', 'whole_core_ns'):
        found[f'linear_{which}'] = rows[0][which]
        found[f'one_effect_{which}'] = rows[1][which]
        known = [cost[which] for cost in each.values()]
        found[f'worst_effect_{which}'] = None if None in known else max(known)
    return found


def online(out: Path, seconds: float = 60.0) -> dict[str, Any]:
    """The estimator's nodes over DDS, its core without them (`core_`), and replay of a bag."""
    from benchmarks import nodes
    from benchmarks import online as bench

    core = bench.run()
    return {
        **nodes.run(seconds),
        **bench.replayed(),
        **{f'core_{name}': value for name, value in core.items()},
    }


def diagnosis(out: Path) -> dict[str, Any]:
    """Time of a whole diagnosis."""
    from benchmarks import diagnosis as bench

    return bench.run()


def first_use(out: Path) -> dict[str, Any]:
    """Import of the command line."""
    began = time.perf_counter()
    _isolated(sys.executable, 'actuator_glue.cli.main', '--help')
    return {'command_line_help_s': time.perf_counter() - began}


PARTS: dict[str, Callable[[Path], dict[str, Any]]] = {
    'likelihood': likelihood,
    'kernel': kernel,
    'problem_r': problem_r,
    'online': online,
    'diagnosis': diagnosis,
    'first_use': first_use,
}


def main() -> int:
    """Run the parts, print the table, return 1 if a part did not run."""
    parser = argparse.ArgumentParser(prog='benchmarks', description=__doc__)
    parser.add_argument('--out', type=Path, default=Path('out/bench'))
    parser.add_argument('--only', nargs='+', choices=PARTS, default=list(PARTS))
    parser.add_argument('--seconds', type=float, default=60.0, help='length of the live run')
    args = parser.parse_args()
    end_in_order()
    parts = PARTS | {'online': partial(online, seconds=args.seconds)}
    out: Path = args.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = {
        'schema': 'actuator_glue.bench/1',
        'machine': {
            'processor': platform.processor() or platform.machine(),
            'cores': os.cpu_count(),
            'python': platform.python_version(),
            'load_before': os.getloadavg()[0],
        },
    }
    failed: dict[str, str] = {}
    for name in args.only:
        print(f'{name} ..', flush=True)
        began = time.perf_counter()
        try:
            found[name] = parts[name](out)
        except Exception as error:
            # One part that breaks must not cost the others' results.
            detail = getattr(error, 'stderr', None) or str(error)
            failed[name] = f'{type(error).__name__}: {detail.strip()[-500:]}'
        print(f'{name}: {time.perf_counter() - began:.0f} s', flush=True)
    if failed:
        found['failed'] = failed
    (out / 'bench.json').write_text(json.dumps(found, indent=2) + '\n')

    from benchmarks import report

    text = report.table(found)
    (out / 'bench.md').write_text(text)
    report.picture(found, out / 'bench.png')
    print(text)
    print(f'results in {out}')
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main())
