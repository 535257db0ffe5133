"""A worker process that is restarted, killed or closed at whatever moment."""

import os
import signal
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
    process.join(5.0)
    assert process.exitcode is not None and not answers
