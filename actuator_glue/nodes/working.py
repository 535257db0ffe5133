"""A node whose computing is done by a process beside it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import TypeAlias

from actuator_glue.nodes import base
from actuator_glue.nodes.health import ERROR
from actuator_glue.workers.worker import DIED, Answer, Worker

# Whose answer it is, who takes it, and the answer.
_Said: TypeAlias = tuple[Worker, Callable[[Answer], None], Answer]


class WorkingNode(base.SuiteNode):
    """Has a worker, and listens only once that is ready.

    Whoever publishes a stream counts subscribers of its samples to know that all is ready: a
    worker that has yet to compile would drop window after window.
    """

    worker: Worker

    def listen(self) -> None:
        """Subscribe; called while active, once the worker is ready."""

    def answered(self, answer: Answer) -> None:
        """Take what the worker says, in the executor's thread; after DIED another has begun."""

    @property
    def compiling(self) -> bool:
        """Whether the worker is not ready yet."""
        return not self.worker.ready.is_set()

    def employ(self, warm: Callable[[], None], nice: int = 0) -> None:
        """Start the worker, which ends at clean-up; arguments as `Worker`."""
        self._answers: deque[_Said] = deque()
        self._arrived = self.create_guard_condition(self.guarded(self._take_answers))
        self.at_cleanup(lambda: self.destroy_guard_condition(self._arrived))
        self.worker = Worker(self._hand_over, warm, nice)
        self.at_cleanup(self.worker.close)

    def colleague(self, answered: Callable[[Answer], None], nice: int) -> Worker:
        """Return another worker, which is not warmed up, until it is dismissed or clean-up.

        Args:
            answered: takes what it says, in the executor's thread; after DIED another has begun.
            nice: as `Worker` takes it.
        """

        def hand_over(answer: Answer) -> None:
            self._answers.append((worker, answered, answer))
            self._arrived.trigger()

        worker = Worker(hand_over, None, nice)
        self.at_cleanup(worker.close)
        return worker

    def dismiss(self, worker: Worker) -> None:
        """End another worker, whatever it does."""
        worker.close(0.0)
        self._forget(worker)

    def give_up(self) -> None:
        """End what the worker does; another begins."""
        self.worker.restart()
        self._forget(self.worker)

    def listen_when_ready(self) -> None:
        """Have `listen` called as soon as the worker is ready; call it on activation."""
        if not self.compiling:
            self.listen()
            return
        began = time.monotonic()
        self.get_logger().info('compiling; samples are listened to when that is done')

        def look() -> None:
            if self.compiling:
                return
            timer.cancel()
            self.listen()
            seconds = time.monotonic() - began
            self.get_logger().info(f'ready after {seconds:.1f} s: listening to samples')

        timer = self.every(0.1, look)

    def do_report(self) -> None:
        """Whether the worker is ready."""
        if hasattr(self, 'worker'):
            self.health.values['worker'] = 'compiling' if self.compiling else 'ready'
            if self.active and self.compiling:
                # Shown, not logged: the log says it when it begins.
                text = 'still compiling: samples are not listened to yet'
                self.health.fault('warm-up', text, time.monotonic())

    def _hand_over(self, answer: Answer) -> None:
        """Called from the listening thread: hand over to the executor."""
        self._answers.append((self.worker, self.answered, answer))
        self._arrived.trigger()

    def _forget(self, worker: Worker) -> None:
        """Let go of what a worker has said and nobody has taken."""
        others = [said for said in self._answers if said[0] is not worker]
        self._answers.clear()
        self._answers.extend(others)

    def _take_answers(self) -> None:
        while self._answers:
            worker, answered, answer = self._answers.popleft()
            if answer.kind == DIED:
                # Also of an inactive node: the next activation needs one.
                self.complain('worker', f'{answer.payload}; starting another', ERROR)
                worker.restart()
            answered(answer)
