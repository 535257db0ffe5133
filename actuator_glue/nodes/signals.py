"""SIGINT and SIGTERM: the first one ends a node in order, whatever thread it reaches."""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable

# Signals within this time count as one [s]: `timeout -s INT`, a launch without a
# terminal and Ctrl-C in a shell's group reach a node twice.
REPEATS_SECONDS = 1.0


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
        first: float | None = None
        while True:
            number = self._reader.recv(1)[0]
            now = time.monotonic()
            if first is None:
                first = now
                self.reason = signal.Signals(number).name
                self._event.set()
                self.wake()
            elif number == signal.SIGINT and now - first > REPEATS_SECONDS:
                print('interrupted again: ending at once', file=sys.stderr, flush=True)
                os._exit(128 + number)
