"""Publishing on time: a plain thread, because a 1 kHz ROS timer costs three times as much."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

# A step counts as late from here on [s]; the operating system's sleep is good for a tenth of it.
LATE = 5e-3
# A clock that is not the computer's own is looked at this often [s], and has jumped where it moves
# on by more than this between two looks [s], and by more than so many times what has passed on
# this computer: a node that was held up has seen no jump. Of a clock that is faster than that,
# the times are so many of what it has shown over some seconds [1; s].
LOOK = 5e-3
JUMP = 1.0
FASTEST = 10.0
FASTER, LEARNT = 3.0, 2.0


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
        ready: called until it is true: the stream may begin.
        speed: stream seconds per second; 0 for as fast as possible.
        done: called in the thread after the last step, or with what a step raised.
        clock: time that paces [s]; None for the computer's. One that stands still holds the
            stream up, and where it jumps the stream goes on from there.
        jumped: called in the thread when it has jumped.

    Attributes:
        late: how many steps were late.
        latest: by how much the latest of them was [s].
        behind: by how much the last step was [s].
    """

    def __init__(
        self,
        steps: Iterator[Step],
        ready: Callable[[], bool],
        speed: float,
        done: Callable[[BaseException | None], None],
        clock: Callable[[], float] | None = None,
        jumped: Callable[[], None] = lambda: None,
    ) -> None:
        self._steps = steps
        self._ready = ready
        self._speed = speed
        self._done = done
        self._clock = clock
        self._jumped = jumped
        self._stop = threading.Event()
        self._start = self._seen = self._looked = 0.0
        self._since = 0.0, 0.0
        self.late = 0
        self.latest = self.behind = 0.0
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
        self.behind = 0.0  # nothing is due any more
        if not self._stop.is_set():
            self._done(failure)

    def _pace(self) -> None:
        while not self._ready():
            if self._stop.wait(0.02):
                return
        begun = False
        for step in self._steps:
            if not begun:
                # The first step is made before the stream begins: what it takes is not lateness.
                self._start = self._seen = self._now()
                self._looked = time.monotonic()
                self._since = self._seen, self._looked
                begun = True
            if self._speed > 0.0:
                self._wait(step.due / self._speed)
            if self._stop.is_set():
                return
            step.act()

    def _now(self) -> float:
        return time.monotonic() if self._clock is None else self._clock()

    def _fastest(self) -> float:
        """Return how fast the clock may run, by what it has shown since it began or jumped."""
        clock, steady = self._seen - self._since[0], self._looked - self._since[1]
        return max(FASTEST, FASTER * clock / steady) if steady > LEARNT else FASTEST

    def _wait(self, due: float) -> None:
        """Wait until a step is due; note where it is late."""
        waited = False
        while not self._stop.is_set():
            now = self._now()
            if self._clock is not None:
                looked = time.monotonic()
                moved, passed = now - self._seen, looked - self._looked
                jumped = not 0.0 <= moved <= max(JUMP, self._fastest() * passed)
                self._seen, self._looked = now, looked
                if jumped:
                    self._since = now, looked
                    # What is late by now is due now: stamps go on from here, and would run ahead.
                    self._start = max(self._start + moved, now - due)
                    self._jumped()
            wait = self._start + due - now
            if wait <= 0.0:
                self.behind = -wait
                if not waited and wait < -LATE:
                    self.late += 1
                    self.latest = max(self.latest, -wait)
                return
            waited = True
            self._stop.wait(wait if self._clock is None else min(wait, LOOK))
