"""What the machine itself withholds: a process that only wakes up, and how late it does."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection

_PERIOD = 2e-3  # s
_NOTICED = 10e-3  # s; a scheduler that is merely busy is rarely that late


@contextmanager
def watched(core: int) -> Iterator[list[float]]:
    """Yield a list that holds, once the block is left, by how much wake-ups were late [s].

    The process has real-time priority where the system grants it: then nothing but the kernel, or
    a host that shares its processors, can hold it up.
    """
    found: list[float] = []
    context = multiprocessing.get_context('spawn')
    ours, theirs = context.Pipe()
    process = context.Process(target=_watch, args=(core, theirs), daemon=True)
    process.start()
    theirs.close()  # or we wait for ever for one that was ended together with us
    try:
        yield found
    finally:
        with suppress(EOFError, OSError):
            ours.send(None)
            found += ours.recv()
        process.join()


def _watch(core: int, pipe: Connection) -> None:
    os.sched_setaffinity(0, {core})
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
    late: list[float] = []
    last = time.monotonic()
    while not pipe.poll():
        time.sleep(_PERIOD)
        now = time.monotonic()
        if now - last > _NOTICED + _PERIOD:
            late.append(now - last - _PERIOD)
        last = now
    pipe.send(late)
