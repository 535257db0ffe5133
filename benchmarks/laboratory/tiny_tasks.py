"""What a scheduler costs a task, and whether memory stays flat: many records that take no time.

`python -m benchmarks.laboratory.tiny_tasks --tasks 100000 --workers 1`. Scheduler and workers are
processes of their own. Writes tiny_tasks.json and tiny_tasks.md.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import actuator_glue as ag
from actuator_glue.campaigns.grouping import Task
from actuator_glue.campaigns.progress_file import Progress
from actuator_glue.campaigns.record_process import THREADS

_PAGE = os.sysconf('SC_PAGE_SIZE') / 1e6  # MB


def nothing(task: Task, folder: Path, key: str) -> dict[str, Any]:
    """Return a row for which nothing was computed."""
    return {'verdict': 'none', 'group_name': task.group}


def resident(pid: int) -> float:
    """Return the memory of a process [MB]."""
    return int(Path(f'/proc/{pid}/statm').read_text('utf-8').split()[1]) * _PAGE


def worked(pid: int) -> float:
    """Return the processor time that a process has taken [s]."""
    fields = Path(f'/proc/{pid}/stat').read_text('utf-8').rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def start(*args: object) -> subprocess.Popen[bytes]:
    """Start a program of dask, its threads pinned."""
    environment = {**os.environ, **dict.fromkeys(THREADS, '1')}
    return subprocess.Popen(
        [sys.executable, '-m', *map(str, args)], env=environment, stderr=subprocess.DEVNULL
    )


def main() -> int:
    """Run, watch memory, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--tasks', type=int, default=100_000, help='records')
    parser.add_argument('--workers', type=int, default=1, help='processes that compute')
    parser.add_argument('--out', type=Path, default=Path('out/tiny_tasks'), help='folder')
    args = parser.parse_args()
    for i in range(args.tasks):
        path = args.out / 'records' / f'{i // 1000:04d}' / f'{i:07d}.csv'
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(str(i))
    place = args.out / 'scheduler.json'
    place.unlink(missing_ok=True)
    scheduler = start(
        'distributed.cli.dask_scheduler',
        '--scheduler-file',
        place,
        '--host',
        '127.0.0.1',
        '--port',
        '0',
        '--no-dashboard',
    )
    while not (place.exists() and place.read_text('utf-8').endswith('}')):
        time.sleep(0.1)
    address = json.loads(place.read_text('utf-8'))['address']
    workers = [
        start(
            'distributed.cli.dask_worker',
            address,
            '--nthreads',
            '1',
            '--no-dashboard',
            '--no-nanny',
            '--host',
            '127.0.0.1',
        )
        for _ in range(args.workers)
    ]
    samples: list[dict[str, float]] = []
    began = time.perf_counter()

    def look(now: Progress) -> None:
        memory = {'client': os.getpid(), 'scheduler': scheduler.pid, 'worker': workers[0].pid}
        sizes = {name: resident(pid) for name, pid in memory.items()}
        times = {f'{name}_cpu': worked(pid) for name, pid in memory.items()}
        at = {'tasks': now.done, 'seconds': time.perf_counter() - began}
        samples.append({**at, **sizes, **times})

    try:
        ag.campaign(
            args.out / 'records',
            args.out / 'out',
            scheduler=address,
            progress=look,
            analysis='benchmarks.laboratory.tiny_tasks:nothing',
        )
    finally:
        for process in (*workers, scheduler):
            process.terminate()
    (args.out / 'tiny_tasks.json').write_text(json.dumps(samples, indent=1) + '\n')
    table = text(samples, args.tasks, args.workers)
    (args.out / 'tiny_tasks.md').write_text(table)
    print(table)
    return 0


def text(samples: list[dict[str, float]], tasks: int, workers: int) -> str:
    """Return memory over the run as a table of Markdown; the last look is at the result."""
    during = [s for s in samples[:-1] if s['tasks']] or samples
    first, last = during[0], during[-1]

    def each(name: str) -> float:
        return 1e3 * (last[name] - first[name]) / max(last['tasks'] - first['tasks'], 1)

    shares = ', '.join(f'{n} {each(f"{n}_cpu"):.2f} ms' for n in ('client', 'scheduler', 'worker'))
    lines = [
        f'{tasks} tasks, {workers} worker(s): {each("seconds"):.1f} ms a task by the clock; '
        f'processor time: {shares}',
        '',
        '| tasks done | client [MB] | scheduler [MB] | worker [MB] |',
        '|---|---|---|---|',
    ]
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        s = min(during, key=lambda s: abs(s['tasks'] - share * last['tasks']))
        lines.append(
            f'| {s["tasks"]:.0f} | {s["client"]:.0f} | {s["scheduler"]:.0f} | {s["worker"]:.0f} |'
        )
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    raise SystemExit(main())
