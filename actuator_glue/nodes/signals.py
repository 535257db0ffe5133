"""SIGINT and SIGTERM: the first one ends a node in order, whatever thread it reaches."""

from __future__ import annotations

import os
import select
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable

# Signals within this time count as one [s]: `timeout -s INT`, a launch without a
# terminal and Ctrl-C in a shell's group reach a node twice.
REPEATS_SECONDS = 1.0
# How often that time is looked at [s].
TICK = 0.05


def end_at_once() -> None:
    """Have SIGINT end the process, in order: a start has nothing to lose yet."""
    signal.signal(signal.SIGINT, lambda *_: os._exit(0))


class Stop:
    """Set by the first SIGINT or SIGTERM, without interrupting whatever callback is running.

    A SIGINT a second later or more ends the process at once, for whoever does not want to wait
    for a node that hangs. A SIGTERM after another signal does nothing: launch sends one to nodes
    that are still finishing their work.

    Attributes:
        reason: name of the signal that came, empty for none.

    Python's own handlers run in the main thread only, which waits inside the middleware; the
    wake-up descriptor is written at once, whatever thread the signal reaches.
    """

    def __init__(self) -> None:
        self._event = threading.Event()
        self.reason = ''
        # Makes the executor return to its loop; the node gives it when it is there.
        self.wake: Callable[[], None] = lambda: None
        self._reader, writer = socket.socketpair()
        writer.setblocking(False)
        self._writer = writer
        # First what hears a signal, then what keeps it from ending the process: in the other order
        # one that came between the two would be lost.
        signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: None)
        threading.Thread(target=self._listen, name='signals', daemon=True).start()

    def is_set(self) -> bool:
        """Whether the node is to end."""
        return self._event.is_set()

    def set(self) -> None:
        """End the node, without a signal."""
        self._event.set()

    def done(self) -> None:
        """Ignore further signals; the last thing a process does.

        Python gives signals their default action while it shuts down: one that comes then would
        make a failure of a node that has done its work.
        """
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)

    def _listen(self) -> None:
        # Since the first signal [s], without the time for which this thread was held up: the two
        # signals of a launch are not told apart by a busy computer.
        age: float | None = None
        last = time.monotonic()
        while True:
            young = age is not None and age <= REPEATS_SECONDS
            came = select.select([self._reader], [], [], TICK if young else None)[0]
            now = time.monotonic()
            if young and age is not None:
                age += min(now - last, 2.0 * TICK)
            last = now
            if not came:
                continue
            number = self._reader.recv(1)[0]
            if age is None:
                age = 0.0
                self.reason = signal.Signals(number).name
                self._event.set()
                self.wake()
            elif number == signal.SIGINT and age > REPEATS_SECONDS:
                print('interrupted again: ending at once', file=sys.stderr, flush=True)
                os._exit(128 + number)
