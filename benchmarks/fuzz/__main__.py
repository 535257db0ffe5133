"""Inputs by the thousand for everything that reads what others made.

`make fuzz`, or `python -m benchmarks.fuzz --inputs 100000 --out out/fuzz`. Each target runs in a
process of its own under libFuzzer (atheris), which keeps and changes further whatever reaches new
lines; only InputError may come out, soon, within a limit of memory. Exit code 1 where not.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

SECONDS = 20  # for one input, on a computer with other work and every line counted
RESIDENT = 1500  # MB that a process may take
DATA = 4 << 30  # bytes that it may ask for
LONGEST = 64_000  # bytes of an input


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    made = argparse.ArgumentParser(prog='python -m benchmarks.fuzz', description=__doc__)
    made.add_argument('--inputs', type=int, default=100_000, help='in all, over the targets')
    made.add_argument('--only', nargs='*', default=[], help='targets, all by default')
    made.add_argument('--seed', type=int, default=1)
    made.add_argument('--out', type=Path, default=Path('out/fuzz'), help='folder of the results')
    made.add_argument('--child', help=argparse.SUPPRESS)
    return made


def child(name: str, out: Path, inputs: int, seed: int) -> None:
    """Fuzz one target; libFuzzer ends the process."""
    import atheris

    resource.setrlimit(resource.RLIMIT_DATA, (DATA, DATA))
    with atheris.instrument_imports(include=['actuator_glue', 'rosbags', 'mcap', 'nptdms']):
        from actuator_glue.errors import InputError
        from benchmarks.fuzz.targets import TARGETS
    warnings.simplefilter('ignore')  # a damaged file may be warned of; exceptions are looked for
    target = TARGETS[name]
    scratch = Path(tempfile.mkdtemp(dir='/dev/shm' if Path('/dev/shm').is_dir() else None))
    corpus = out / 'corpus'
    corpus.mkdir(parents=True, exist_ok=True)
    for number, content in enumerate(target.seeds(scratch)):
        (corpus / f'seed_{number}').write_bytes(content)
    words = out / 'words.txt'
    words.write_text(
        ''.join(
            '"' + ''.join(f'\\x{byte:02x}' for byte in word.encode()) + '"\n'
            for word in target.words
        )
    )
    use = target.user(scratch)

    def take(data: bytes) -> None:
        try:
            use(data)
        except InputError as error:
            if not str(error).isprintable():
                raise ValueError(f'not printable: {error!r}') from error

    options: dict[str, object] = {
        'runs': inputs,
        'seed': seed,
        'timeout': SECONDS,
        'rss_limit_mb': RESIDENT,
        'max_len': LONGEST,
        'len_control': 0,
        'print_final_stats': 1,
        'artifact_prefix': f'{out}/',
    }
    if target.words:
        options['dict'] = words
    given = [f'-{option}={value}' for option, value in options.items()]
    atheris.Setup([sys.argv[0], *given, str(corpus)], take)
    try:
        atheris.Fuzz()
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def run(name: str, out: Path, inputs: int, seed: int) -> dict[str, Any]:
    """Fuzz one target in a process of its own; return what came of it."""
    out.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, '-m', 'benchmarks.fuzz', '--child', name]
    command += ['--out', str(out), '--inputs', str(inputs), '--seed', str(seed)]
    # Compiled code counts no lines.
    environment = {**os.environ, 'NUMBA_DISABLE_JIT': '1'}
    with (out / 'log.txt').open('w') as log:
        done = subprocess.run(
            command, stdout=log, stderr=subprocess.STDOUT, env=environment, check=False
        )
    text = (out / 'log.txt').read_text(errors='replace')
    found = {k: int(v) for k, v in re.findall(r'stat::(\w+):\s+(\d+)', text)}
    covered = [int(v) for v in re.findall(r'cov: (\d+)', text)]
    return {
        'target': name,
        'exit_code': done.returncode,
        'inputs': found.get('number_of_executed_units', 0),
        'kept': found.get('new_units_added', 0),
        'covered_before_and_after': covered[:1] + covered[-1:],
        'slowest_s': found.get('slowest_unit_time_sec'),
        'peak_MB': found.get('peak_rss_mb'),
        'failed': sorted(p.name for p in out.iterdir() if re.match('crash|timeout|oom', p.name)),
    }


def main() -> int:
    """Fuzz every target with its share; 1 where one of them did not hold."""
    args = parser().parse_args()
    if args.child:
        child(args.child, args.out, args.inputs, args.seed)
        return 0
    from benchmarks.fuzz.targets import TARGETS

    names = args.only or list(TARGETS)
    found = []
    for name in names:
        folder = args.out / name
        shutil.rmtree(folder, ignore_errors=True)
        found.append(run(name, folder, -(-args.inputs // len(names)), args.seed))
        print(json.dumps(found[-1]), flush=True)
    total = sum(entry['inputs'] for entry in found)
    bad = [e['target'] for e in found if e['exit_code'] or e['failed'] or not e['inputs']]
    result = {'schema': 'actuator_glue.fuzz/1', 'inputs': total, 'not_held': bad, 'targets': found}
    (args.out / 'fuzz.json').write_text(json.dumps(result, indent=2) + '\n')
    print(f'{total} inputs; ' + (f'not held: {", ".join(bad)}' if bad else 'all held'))
    return 1 if bad or total < args.inputs else 0


if __name__ == '__main__':
    sys.exit(main())
