"""A worker process, for work that must not hold up the process that asks for it."""

from __future__ import annotations

import gc
import multiprocessing
import os
import queue
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from actuator_glue.model.effects import CATALOGUE

# Messages from the worker: (kind, payload).
DONE, FAILED, PROGRESS, DIED = 'done', 'failed', 'progress', 'died'

Tell = Callable[[Any], None]


class Answer(NamedTuple):
    """What a worker says: kind, payload, and seconds it has worked on the task."""

    kind: str
    payload: Any
    seconds: float


class Worker:
    """Runs picklable functions, one at a time, in a process of its own.

    The process is started afresh, not forked, because forked threads of DDS would be dead locks.
    It ends with its parent, however that ends.

    Args:
        answer: called from a thread with each Answer.
        warm: picklable function called once at the start, to compile and import.
        nice: added to the scheduling priority's niceness.
    """

    def __init__(
        self, answer: Callable[[Answer], None], warm: Callable[[], None] | None, nice: int = 0
    ) -> None:
        self._answer = answer
        self._warm = warm
        self._nice = nice
        self._tasks: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.ready = threading.Event()
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
        self._end(patience)

    def _start(self) -> None:
        context = multiprocessing.get_context('spawn')
        self.ready.clear()
        # Closed with the last reference to it: never while a thread still reads.
        ours, theirs = context.Pipe()
        self._process: Any = context.Process(
            target=_serve, args=(theirs, self._warm, self._nice), daemon=True, name='worker'
        )
        # It begins with Ctrl-C blocked: its imports shall not be cut, with a traceback each. The
        # tracker comes first: what starts it unblocks the signal again.
        resource_tracker.ensure_running()
        masked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, masked)
        theirs.close()
        # The tasks of an ended process are not the next one's.
        self._tasks = queue.SimpleQueue()
        for name, target, args in (
            ('answers', self._listen, (ours, self._process)),
            ('tasks', self._hand_over, (ours, self._tasks)),
        ):
            threading.Thread(target=target, args=args, daemon=True, name=name).start()

    def _end(self, patience: float) -> None:
        # Whoever hears of its end knows that it was asked for.
        process, self._process = self._process, None
        self._tasks.put(None)
        if process is None:
            return
        process.join(patience)
        if process.is_alive():
            process.kill()
            process.join(2.0)

    def _hand_over(self, pipe: Connection, tasks: queue.SimpleQueue[Any]) -> None:
        with suppress(OSError):  # a process that died is told where its answers are read
            while (task := tasks.get()) is not None:
                pipe.send(task)
            pipe.send(None)

    def _listen(self, pipe: Connection, process: Any) -> None:
        while True:
            try:
                answer = pipe.recv()
            except (EOFError, OSError):
                break
            if process is not self._process:
                break  # what an ended process still said is nobody's answer
            if answer is None:
                self.ready.set()
            else:
                self._answer(Answer(*answer))
        if process is self._process:
            process.join(1.0)
            self._answer(Answer(DIED, f'the worker process ended ({process.exitcode})', 0.0))


def _serve(pipe: Connection, warm: Callable[[], None] | None, nice: int) -> None:
    # Ctrl-C reaches the whole group: the node decides when its worker ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGTERM})
    if nice:
        os.nice(nice)

    started = time.monotonic()

    def tell(payload: Any) -> None:
        pipe.send((PROGRESS, payload, time.monotonic() - started))

    # Whoever asked has gone: nothing is left to answer.
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        if warm is not None:
            warm()
        # What is there now stays: going through it for garbage takes 100 ms, two deadlines.
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
