"""The process in which a worker computes: what a record does to it costs that record alone."""

from __future__ import annotations

import importlib
import json
import os
import resource
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue

from actuator_glue.campaigns.grouping import Task
from actuator_glue.campaigns.rows import Row
from actuator_glue.errors import InputError

# The work is one thread's, whatever computes: cores are shared out by the number of workers.
THREADS = (
    'NUMBA_NUM_THREADS',
    'OMP_NUM_THREADS',
    'OPENBLAS_NUM_THREADS',
    'MKL_NUM_THREADS',
    'VECLIB_MAXIMUM_THREADS',
)
_GB = 1 << 30


class RecordProcess:
    """A process that computes rows, one at a time; one that dies is replaced for the next.

    It ends with the process that started it, however that ends.

    Args:
        analysis: `module:function` that makes a row of (task, folder, key).
        memory_gb: what it may take [GB].
    """

    def __init__(self, analysis: str, memory_gb: float) -> None:
        self.analysis, self.memory_gb = analysis, memory_gb
        self._process: subprocess.Popen[bytes] | None = None

    def row(self, task: Task, folder: Path, key: str, seconds: float) -> Row:
        """Return what the analysis makes of a task in so many seconds, or why that is nothing."""
        process = self._started()
        assert process.stdin is not None
        order = {'task': task.to_json(), 'folder': str(folder), 'key': key}
        try:
            process.stdin.write(json.dumps(order).encode() + b'\n')
            process.stdin.flush()
            answer = self._answer(process, seconds)
        except BrokenPipeError:
            answer = b''
        if answer is None:
            self.close()
            return {'failure': f'took longer than {seconds:g} s'}
        if not answer:
            return {'failure': self._end(process)}
        row: Row = json.loads(answer)
        if row.pop('out_of_memory', False):
            self.close()  # the memory it had taken may still be held
        return row

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.communicate()

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None or self._process.poll() is not None:
            self._process = subprocess.Popen(
                [sys.executable, '-m', __name__, self.analysis, str(self.memory_gb)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, **dict.fromkeys(THREADS, '1')},
            )
        return self._process

    def _answer(self, process: subprocess.Popen[bytes], seconds: float) -> bytes | None:
        """Return a line of the process; None after so many seconds, empty where it has ended."""
        assert process.stdout is not None
        pipe, line, end = process.stdout.fileno(), b'', time.monotonic() + seconds
        while not line.endswith(b'\n'):
            if not select.select([pipe], [], [], max(end - time.monotonic(), 0.0))[0]:
                return None
            part = os.read(pipe, 1 << 20)
            if not part:
                return b''
            line += part
        return line

    def _end(self, process: subprocess.Popen[bytes]) -> str:
        status = process.wait()
        self.close()
        if status >= 0:
            return f'its process ended with status {status}'
        name = signal.Signals(-status).name if -status in {s.value for s in signal.Signals} else ''
        return f'its process was ended by signal {-status} {name}'.rstrip()


def _serve(analysis: str, memory_gb: float) -> None:
    """Answer orders of standard input with rows on standard output until there are no more."""
    os.environ.update(dict.fromkeys(THREADS, '1'))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever gives the orders
    size = int(memory_gb * _GB)
    resource.setrlimit(resource.RLIMIT_DATA, (size, size))
    # What libraries print is no answer.
    answers = os.fdopen(os.dup(1), 'wb')
    os.dup2(2, 1)
    orders: SimpleQueue[bytes] = SimpleQueue()

    def listen() -> None:
        for line in sys.stdin.buffer:
            orders.put(line)
        os._exit(0)  # whoever gave orders has gone, and nobody waits for what is computed

    threading.Thread(target=listen, daemon=True).start()
    module, _, name = analysis.partition(':')
    function = getattr(importlib.import_module(module), name)
    while True:
        order = json.loads(orders.get())
        task = Task.from_json(order['task'])
        row = _guarded(function, task, Path(order['folder']), order['key'], memory_gb)
        answers.write(json.dumps(row).encode() + b'\n')
        answers.flush()


def _guarded(
    function: Callable[[Task, Path, str], Row], task: Task, folder: Path, key: str, memory: float
) -> Row:
    from actuator_glue.json_value import json_value

    try:
        return dict(json_value(function(task, folder, key)))
    except InputError as error:
        return {'failure': str(error)}
    except MemoryError:
        return {'failure': f'needs more than {memory:g} GB of memory', 'out_of_memory': True}
    except Exception as error:
        kind = type(error).__name__
        return {'failure': f'fault in actuator-glue, please report it: {kind}: {error}'}


if __name__ == '__main__':
    _serve(sys.argv[1], float(sys.argv[2]))
