"""A worker process that is restarted, killed or closed at whatever moment."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from actuator_glue.workers.worker import DIED, DONE, FAILED, PROGRESS, Worker


def open_files():
    """Number of files and pipes this process has open."""
    return len(list(Path('/proc/self/fd').iterdir()))


class Answers(list):
    """What a worker said, and a way to wait for it."""

    def wait(self, count, seconds=30.0):
        end = time.monotonic() + seconds
        while len(self) < count:
            assert time.monotonic() < end, f'{count} answers wanted, these came: {self}'
            time.sleep(0.01)
        return [answer.kind for answer in self]


def double(number, tell):
    """Work: tell the number, return it doubled."""
    tell(number)
    return 2 * number


def fail(_):
    raise ValueError('no')


def busy(_):
    while True:
        pass


@pytest.fixture
def answers(monkeypatch):
    """Answers; whatever a thread raises fails the test."""
    raised = []
    monkeypatch.setattr(threading, 'excepthook', raised.append)
    yield Answers()
    assert not raised


@pytest.fixture
def worker(answers):
    made = Worker(answers.append, None)
    yield made
    made.close()


def test_work_failure_and_progress_are_answered_in_order(worker, answers):
    worker.submit(double, 4)
    worker.submit(fail)
    worker.submit(double, 5)
    assert answers.wait(5) == [PROGRESS, DONE, FAILED, PROGRESS, DONE]
    assert [a.payload for a in answers] == [4, 8, 'ValueError: no', 5, 10]


@pytest.mark.slow
def test_a_restart_gives_up_the_work_and_is_no_death(worker, answers):
    """At whatever moment of its start or work it comes."""
    before = open_files()
    for attempt in range(8):
        worker.submit(busy)
        if attempt % 2:
            assert worker.ready.wait(30.0)
        time.sleep(0.02 * attempt)
        worker.restart()
    worker.submit(double, 1)
    assert answers.wait(2) == [PROGRESS, DONE]
    time.sleep(0.3)
    assert len(answers) == 2
    # Threads and pipes of the processes before have ended with them.
    names = [t.name for t in threading.enumerate()]
    assert names.count('answers') == names.count('tasks') == 1
    assert open_files() <= before + 8


def test_a_killed_process_is_told_once_and_replaced(worker, answers):
    assert worker.ready.wait(30.0)
    worker.submit(busy)
    os.kill(worker._process.pid, signal.SIGKILL)
    assert answers.wait(1) == [DIED] and '-9' in answers[0].payload
    worker.restart()
    worker.submit(double, 1)
    assert answers.wait(3) == [DIED, PROGRESS, DONE]


def test_it_is_closed_twice_or_before_it_has_begun(answers):
    worker = Worker(answers.append, None)
    process = worker._process
    worker.close(patience=0.0)
    worker.close()
    assert process.wait(60.0) is not None and not answers


ORPHAN = """
import time
from functools import partial
from actuator_glue.workers.worker import Worker
worker = Worker(lambda answer: None, partial(time.sleep, %s))
worker.submit(time.sleep, 600.0)
print(worker._process.pid, %s or worker.ready.wait(60.0), flush=True)
time.sleep(600.0)
"""


@pytest.mark.parametrize('warm', [600.0, 0.0])
def test_it_ends_with_who_asks_whatever_it_does(warm):
    """One that has yet to compile went on for minutes."""
    script = ORPHAN % (warm, warm)
    asking = subprocess.Popen(
        [sys.executable, '-c', script], stdout=subprocess.PIPE, text=True, bufsize=1
    )
    try:
        pid, ready = asking.stdout.readline().split()
        assert ready != 'False'
    finally:
        asking.kill()
        asking.wait()
    end = time.monotonic() + 60.0
    while Path(f'/proc/{pid}').exists() and 'Z' not in state(pid):
        assert time.monotonic() < end, 'it is still there'
        time.sleep(0.02)


def state(pid):
    """Return what a process does, `Z` where it has ended."""
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0]
    except OSError:
        return 'Z'


SCRIPT = """
import os, sys, time
import actuator_glue as ag
print('begins', os.getpid())
record = ag.simulate(ag.Command(rate=100.0, duration=9.0, high=5.0), stiffness=250e3, seed=3)
found = ag.replay(record, window=3.0, hop=0.5, evaluations=6000)
from actuator_glue.workers.reports import Reports
with Reports() as reports:  # long enough for whatever a process of its own would do
    print('ready', reports.wait(60.0) or len(os.sched_getaffinity(0)) < 2)
print('windows', len(found.windows))
left = Reports()  # that nobody closes
"""


def test_a_script_needs_no_guard(tmp_path):
    """It runs once, from its first line to its last, and says nothing that is not its own."""
    script = tmp_path / 'mine.py'
    script.write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stderr) == (0, '')
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines] == ['begins', 'ready', 'windows']
    assert lines[1] == 'ready True' and int(lines[2].split()[1]) > 10
