"""What a scheduler costs a task, and whether memory stays flat: many records that take no time.

`python -m benchmarks.laboratory.tiny_tasks --tasks 100000 --workers 1`. Writes tiny_tasks.json and
tiny_tasks.md.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path
from typing import Any

import actuator_glue as ag
from actuator_glue.campaigns.grouping import Task
from actuator_glue.campaigns.progress_file import Progress

NAMES = ('client', 'scheduler', 'worker', 'record')
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


def processes() -> dict[str, int]:
    """Return the processes of the campaign that this one runs, as far as they have started."""
    found, parent = {NAMES[0]: os.getpid()}, os.getpid()
    for name, says in (
        ('scheduler', 'actuator_glue.campaigns.cluster'),
        ('worker', 'spawn_main'),
        ('record', 'actuator_glue.campaigns.record_process'),
    ):
        children = Path(f'/proc/{parent}/task').glob('*/children')
        for pid in map(int, ' '.join(c.read_text('utf-8') for c in children).split()):
            if says in Path(f'/proc/{pid}/cmdline').read_text('utf-8'):
                found[name] = parent = pid
                break
        else:
            break
    return found


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
    samples: list[dict[str, float]] = []
    began = time.perf_counter()

    def look(now: Progress) -> None:
        try:
            of = processes()
            sizes = {name: resident(pid) for name, pid in of.items()}
            times = {f'{name}_cpu': worked(pid) for name, pid in of.items()}
        except OSError:  # one has ended in between
            return
        if len(of) == len(NAMES):
            at = {'tasks': now.done, 'seconds': time.perf_counter() - began}
            samples.append({**at, **sizes, **times})

    ag.campaign(
        args.out / 'records',
        args.out / 'out',
        workers=args.workers,
        progress=look,
        analysis='benchmarks.laboratory.tiny_tasks:nothing',
    )
    (args.out / 'tiny_tasks.json').write_text(json.dumps(samples, indent=1) + '\n')
    table = text(samples, args.tasks, args.workers)
    (args.out / 'tiny_tasks.md').write_text(table)
    print(table)
    return 0


def text(samples: list[dict[str, float]], tasks: int, workers: int) -> str:
    """Return memory over the run as a table of Markdown."""
    during = [s for s in samples if s['tasks']] or samples
    first, last = during[0], during[-1]

    def each(name: str) -> float:
        return 1e3 * (last[name] - first[name]) / max(last['tasks'] - first['tasks'], 1)

    shares = ', '.join(f'{n} {each(f"{n}_cpu"):.2f} ms' for n in NAMES)
    lines = [
        f'{tasks} tasks, {workers} worker(s): {each("seconds"):.1f} ms a task by the clock; '
        f'processor time: {shares}',
        '',
        f'| tasks done | {" | ".join(f"{n} [MB]" for n in NAMES)} |',
        f'|{"---|" * (1 + len(NAMES))}',
    ]
    for share in (0.0, 0.125, 0.25, 0.5, 0.75, 1.0):
        s = min(during, key=lambda s: abs(s['tasks'] - share * last['tasks']))
        lines.append(f'| {s["tasks"]:.0f} | {" | ".join(f"{s[n]:.0f}" for n in NAMES)} |')
    return '\n'.join(lines) + '\n'


if __name__ == '__main__':
    raise SystemExit(main())
