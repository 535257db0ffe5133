"""Analyses of a moment: what a record does to whoever reads it stands in its file."""

import os
import signal
import time
from pathlib import Path
from typing import Any

from actuator_glue.campaigns.grouping import Task
from actuator_glue.errors import InputError

HERE = Path(__file__).resolve().parent
ANALYSIS = 'tiny_analysis:tiny'


def tiny(task: Task, folder: Path, key: str) -> dict[str, Any]:
    """Return how long the files are, or do what their text asks for."""
    texts = [Path(member.path).read_text('utf-8') for member in task.members]
    word, _, amount = texts[0].partition(' ')
    if word == 'crash':
        os.kill(os.getpid(), signal.SIGSEGV)
    if word == 'parent':
        os.kill(os.getppid(), signal.SIGKILL)
    if word == 'leave':
        os._exit(3)
    if word == 'memory':
        return {'sum': sum(bytearray(int(float(amount) * 2**30)))}
    if word == 'sleep':
        time.sleep(float(amount.split()[0]))
    if word == 'fault':
        raise ZeroDivisionError('of a fault')
    if word == 'refuse':
        raise InputError('nothing can be made of this')
    print('what a library says')
    return {
        'verdict': 'none',
        'size': sum(map(len, texts)),
        'root': len(texts[0]) ** 0.5,
        'threads': os.environ['OPENBLAS_NUM_THREADS'],
        'process': os.getpid(),
        'job': os.environ.get('SLURM_JOB_ID', ''),
    }
