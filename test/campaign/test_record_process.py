"""What a record does to the process that reads it costs that record alone."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from actuator_glue.campaigns.grouping import Task, tasks_of
from actuator_glue.campaigns.recipe import Recipe
from actuator_glue.campaigns.record_process import RecordProcess

SECONDS, MEMORY = 20.0, 1.0


@pytest.fixture
def process() -> Iterator[RecordProcess]:
    """A process of the tiny analysis."""
    found = RecordProcess('tiny_analysis:tiny', MEMORY)
    yield found
    found.close()


def task(folder: Path, text: str) -> Task:
    """Return the task of one file with a text."""
    path = folder / f'{text.replace(" ", "_")}.csv'
    path.write_text(text)
    return tasks_of([path], Recipe())[0]


def test_every_end_is_a_row_with_its_reason(process: RecordProcess, tmp_path: Path) -> None:
    """Signal, exit, memory, fault, refusal; the next record has a process all the same."""

    def failure(text: str) -> str:
        return str(process.row(task(tmp_path, text), tmp_path, 'k', SECONDS).get('failure'))

    first = process.row(task(tmp_path, 'well'), tmp_path, 'k', SECONDS)
    assert first['size'] == 4 and first['threads'] == '1'
    assert failure('crash') == 'its process was ended by signal 11 SIGSEGV'
    second = process.row(task(tmp_path, 'again'), tmp_path, 'k', SECONDS)
    assert second['size'] == 5 and second['process'] != first['process']
    assert failure('leave') == 'its process ended with status 3'
    assert failure('memory 2') == 'needs more than 1 GB of memory'
    assert failure('refuse') == 'nothing can be made of this'
    assert failure('fault').endswith('please report it: ZeroDivisionError: of a fault')
    assert failure('well') == 'None'


def test_a_record_has_so_much_time(process: RecordProcess, tmp_path: Path) -> None:
    """And no more; the next one begins at once."""
    process.row(task(tmp_path, 'well'), tmp_path, 'k', SECONDS)
    begin = time.monotonic()
    row = process.row(task(tmp_path, 'sleep 60'), tmp_path, 'k', 0.3)
    assert row == {'failure': 'took longer than 0.3 s'}
    assert time.monotonic() - begin < 50.0  # not the 60 s; the limit is in what it says
    assert process.row(task(tmp_path, 'well'), tmp_path, 'k', SECONDS)['size'] == 4


def test_it_ends_with_its_parent(tmp_path: Path) -> None:
    """However that ends, and whatever it computes then."""
    path = tmp_path / 'long.csv'
    path.write_text('sleep 100')
    code = (
        'import sys, threading, time\n'
        'from pathlib import Path\n'
        'from actuator_glue.campaigns.grouping import tasks_of\n'
        'from actuator_glue.campaigns.recipe import Recipe\n'
        'from actuator_glue.campaigns.record_process import RecordProcess\n'
        f'task = tasks_of([{str(path)!r}], Recipe())[0]\n'
        'process = RecordProcess("tiny_analysis:tiny", 1.0)\n'
        f'order = (task, Path({str(tmp_path)!r}), "k", 99.0)\n'
        'threading.Thread(target=process.row, args=order, daemon=True).start()\n'
        'while process._process is None: time.sleep(0.01)\n'
        'print(process._process.pid, flush=True)\n'
        'time.sleep(100)\n'
    )
    parent = subprocess.Popen([sys.executable, '-c', code], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    end = time.monotonic() + 60.0
    while _runs(child) and time.monotonic() < end:
        time.sleep(0.05)
    assert not _runs(child)


def _runs(pid: int) -> bool:
    """Whether a process computes; one that has ended and is not yet collected does not."""
    try:
        state = Path(f'/proc/{pid}/stat').read_text('utf-8').rpartition(')')[2].split()[0]
        os.kill(pid, 0)
    except OSError:
        return False
    return state != 'Z'
