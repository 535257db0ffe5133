"""A worker process, for work that must not hold up the process that asks for it."""

from __future__ import annotations

import atexit
import gc
import os
import queue
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe
from typing import Any, NamedTuple

from actuator_glue.model.effects import CATALOGUE

# Messages from the worker: (kind, payload).
DONE, FAILED, PROGRESS, DIED = 'done', 'failed', 'progress', 'died'

# What the process begins with, given the descriptor of its end of the pipe.
_PROGRAM = (
    'import sys; from multiprocessing.connection import Connection; '
    'pipe = Connection(int(sys.argv[1])); sys.path[:] = pipe.recv(); '
    f'from {__name__} import serve; serve(pipe)'
)

Tell = Callable[[Any], None]


class Answer(NamedTuple):
    """What a worker says: kind, payload, and seconds it has worked on the task."""

    kind: str
    payload: Any
    seconds: float


class Worker:
    """Runs picklable functions, one at a time, in a process of its own.

    The process is started afresh, not forked, because forked threads of DDS would be dead locks;
    and not by `multiprocessing`, which would run the script anew that asks for it. It ends with
    its parent, however that ends.

    Args:
        answer: called from a thread with each Answer.
        warm: picklable function called once at the start, to compile and import.
        nice: added to the scheduling priority's niceness; where it is not 0, real-time priority
            stays with whoever asks.
    """

    def __init__(
        self, answer: Callable[[Answer], None], warm: Callable[[], None] | None, nice: int = 0
    ) -> None:
        self._answer = answer
        self._warm = warm
        self._nice = nice
        self._tasks: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.ready = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        atexit.register(self.close, 0.0)
        self._start()

    def submit(self, function: Callable[..., Any], *args: Any) -> None:
        """Have `function(*args, tell)` computed; `tell` sends a PROGRESS answer.

        Returns at once; a pipe that is full holds up a thread, not the caller. The process knows
        the effects that are registered here by then.
        """
        self._tasks.put((CATALOGUE.registered(), function, args))

    def restart(self) -> None:
        """End the process whatever it does and start another."""
        self._end(patience=0.0)
        self._start()

    def close(self, patience: float = 0.5) -> None:
        """End the process, after so many seconds at the latest; what it computes is lost."""
        atexit.unregister(self.close)
        self._end(patience)

    def _start(self) -> None:
        self.ready.clear()
        # Closed with the last reference to it: never while a thread still reads.
        ours, theirs = Pipe()
        # It begins with Ctrl-C blocked: its imports shall not be cut, with a traceback each.
        masked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._process = subprocess.Popen(
                [sys.executable, '-c', _PROGRAM, str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
            )
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, masked)
        theirs.close()
        with suppress(OSError):  # a process that died is told where its answers are read
            for begin in (sys.path, (self._warm, self._nice)):
                ours.send(begin)
        # The tasks of an ended process are not the next one's.
        self._tasks = queue.SimpleQueue()
        for name, target, args in (
            ('answers', self._listen, (ours, self._process)),
            ('tasks', self._hand_over, (ours, self._tasks)),
        ):
            threading.Thread(target=target, args=args, daemon=True, name=name).start()

    def _end(self, patience: float) -> None:
        # The thread that sees its end then knows that it was asked for.
        process, self._process = self._process, None
        self._tasks.put(None)
        if process is None:
            return
        with suppress(subprocess.TimeoutExpired):
            process.wait(patience)
        if process.poll() is None:
            process.kill()
            with suppress(subprocess.TimeoutExpired):
                process.wait(2.0)

    def _hand_over(self, pipe: Connection, tasks: queue.SimpleQueue[Any]) -> None:
        with suppress(OSError):  # a process that died is told where its answers are read
            while (task := tasks.get()) is not None:
                pipe.send(task)
            pipe.send(None)

    def _listen(self, pipe: Connection, process: subprocess.Popen[bytes]) -> None:
        while True:
            try:
                answer = pipe.recv()
            except (EOFError, OSError):
                break
            if process is not self._process:
                break  # late answers of an ended process are dropped
            if answer is None:
                self.ready.set()
            else:
                self._answer(Answer(*answer))
        if process is self._process:
            with suppress(subprocess.TimeoutExpired):
                process.wait(1.0)
            self._answer(Answer(DIED, f'the worker process ended ({process.returncode})', 0.0))


def serve(pipe: Connection) -> None:
    """Do what is asked for through a pipe until it closes; first warm up, at lower priority."""
    # Ctrl-C reaches the whole group: the node decides when its worker ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGTERM})
    threading.Thread(target=_end_with, args=(pipe.fileno(),), daemon=True).start()
    started = time.monotonic()

    def tell(payload: Any) -> None:
        pipe.send((PROGRESS, payload, time.monotonic() - started))

    # The asking process has gone: nothing is left to answer.
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        warm, nice = pipe.recv()
        if nice:
            os.nice(nice)
            with suppress(OSError):
                os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        if warm is not None:
            warm()
        # The objects that exist now stay: scanning them for garbage takes 100 ms, two deadlines.
        gc.collect()
        gc.freeze()
        pipe.send(None)
        while (task := pipe.recv()) is not None:
            effects, function, args = task
            started = time.monotonic()
            try:
                CATALOGUE.take(effects)
                kind, payload = DONE, function(*args, tell)
            except Exception as error:
                kind, payload = FAILED, f'{type(error).__name__}: {error}'
            pipe.send((kind, payload, time.monotonic() - started))


def _end_with(pipe: int) -> None:
    """End this process with the asking one, whatever it does: to compile alone takes minutes."""
    gone = select.poll()
    gone.register(pipe, 0)  # that the other end is closed is told unasked
    gone.poll()
    os._exit(0)
