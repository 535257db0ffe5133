"""Publishing on time: a plain thread, because a 1 kHz ROS timer costs three times as much."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import NamedTuple


class Step(NamedTuple):
    """One thing to publish.

    Attributes:
        due: when, since the start of the stream [s].
        act: what to do then.
    """

    due: float
    act: Callable[[], None]


class Pacer:
    """Does steps when they are due, in a thread; a late step is done at once, none is left out.

    Args:
        next_step: returns the next step, None at the end; called in the thread.
        speed: stream seconds per second; 0 for as fast as possible.
        done: called in the thread after the last step, or with what a step raised.
    """

    def __init__(
        self,
        next_step: Callable[[], Step | None],
        speed: float,
        done: Callable[[BaseException | None], None],
    ) -> None:
        self._next = next_step
        self._speed = speed
        self._done = done
        self._stop = threading.Event()
        self.late = 0
        self.latest = 0.0
        self._thread = threading.Thread(target=self._run, name='pacer', daemon=True)

    def start(self) -> None:
        """Begin; the stream's time 0 is now."""
        self._thread.start()

    def stop(self) -> None:
        """End after the step being done."""
        self._stop.set()
        if threading.current_thread() is not self._thread:
            self._thread.join(5.0)

    def _run(self) -> None:
        failure: BaseException | None = None
        try:
            self._pace()
        except Exception as error:
            failure = error
        if not self._stop.is_set():
            self._done(failure)

    def _pace(self) -> None:
        start = time.monotonic()
        while not self._stop.is_set() and (step := self._next()) is not None:
            if self._speed > 0.0:
                wait = start + step.due / self._speed - time.monotonic()
                if wait > 0.0 and self._stop.wait(wait):
                    return
                # Half a millisecond is what the operating system's sleep is good for.
                if wait < -5e-3:
                    self.late += 1
                    self.latest = max(self.latest, -wait)
            step.act()
