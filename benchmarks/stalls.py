"""What the machine itself withholds: a process that only wakes up, and how late it does."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import NamedTuple

_PERIOD = 2e-3  # s
_NOTICED = 10e-3  # s; a scheduler that is merely busy is rarely that late


class Stall(NamedTuple):
    """Between when a process should have woken up and when it did [ns since 1970]."""

    due: int
    woken: int


@contextmanager
def watched(core: int) -> Iterator[list[Stall]]:
    """Yield a list that holds, once the block is left, the wake-ups that were late.

    The process has real-time priority where the system grants it: then nothing but the kernel, or
    a host that shares its processors, can hold it up.
    """
    found: list[Stall] = []
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
    late: list[Stall] = []
    last = time.monotonic()
    while not pipe.poll():
        time.sleep(_PERIOD)
        now = time.monotonic()
        if now - last > _NOTICED + _PERIOD:
            woken = time.time_ns()
            late.append(Stall(woken - round((now - last - _PERIOD) * 1e9), woken))
        last = now
    pipe.send(late)
