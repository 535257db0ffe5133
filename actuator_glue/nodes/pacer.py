"""Publishing on time: a plain thread, because a 1 kHz ROS timer costs three times as much."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

# A step counts as late from here on [s]; the operating system's sleep is good for a tenth of it.
LATE = 5e-3


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
        steps: what to do, in order; iterated in the thread.
        ready: asked until it says that the stream may begin.
        speed: stream seconds per second; 0 for as fast as possible.
        done: called in the thread after the last step, or with what a step raised.
    """

    def __init__(
        self,
        steps: Iterator[Step],
        ready: Callable[[], bool],
        speed: float,
        done: Callable[[BaseException | None], None],
    ) -> None:
        self._steps = steps
        self._ready = ready
        self._speed = speed
        self._done = done
        self._stop = threading.Event()
        self.late = 0
        self.latest = 0.0
        self._thread = threading.Thread(target=self._run, name='pacer', daemon=True)

    def start(self) -> None:
        """Begin as soon as it is ready; that is the stream's time 0."""
        self._thread.start()

    @property
    def stopped(self) -> bool:
        """Whether it was told to end."""
        return self._stop.is_set()

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
        while not self._ready():
            if self._stop.wait(0.02):
                return
        start: float | None = None
        for step in self._steps:
            # The first step is made before the stream begins: whatever it takes is not lateness.
            start = time.monotonic() if start is None else start
            if self._speed > 0.0:
                wait = start + step.due / self._speed - time.monotonic()
                if wait > 0.0:
                    self._stop.wait(wait)
                elif wait < -LATE:
                    self.late += 1
                    self.latest = max(self.latest, -wait)
            if self._stop.is_set():
                return
            step.act()
