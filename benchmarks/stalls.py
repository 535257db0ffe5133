"""What the machine itself withholds, and how to keep it from doing so."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

import numpy as np

from actuator_glue.records import Array

_LATENCY = Path('/dev/cpu_dma_latency')
_PERIOD = 5e-4  # s
_NOTICED = 3e-4  # s; with real-time priority a process wakes up within a third of that
_PRIORITY = 50
_ASKED = 100  # wake-ups between looks whether to end


class Stall(NamedTuple):
    """Between when a process should have woken up and when it did [ns since 1970]."""

    due: int
    woken: int


@contextmanager
def awake() -> Iterator[bool]:
    """Keep idle processors from sleeping while the block runs; yield whether that is granted.

    Real-time computers do so since waking up takes time. A host that shares its processors gives a
    sleeping one to others, and it is back when they are done.
    """
    try:
        request = os.open(_LATENCY, os.O_WRONLY)
    except OSError:
        yield False
        return
    try:
        os.write(request, (0).to_bytes(4, sys.byteorder))
        yield True  # holds as long as the file is open
    finally:
        os.close(request)


@contextmanager
def watched(core: int) -> Iterator[list[Stall]]:
    """Yield a list that holds, once the block is left, when the machine withheld a core.

    The process has real-time priority: nothing but the kernel, or a host that shares its
    processors, can hold it up. Where the system grants none the list stays empty, since the work
    on that core would pass for the machine's.
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
    late: list[Stall] = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except PermissionError:
        pipe.poll(None)
    last = time.monotonic()
    while not pipe.poll():
        for _ in range(_ASKED):
            time.sleep(_PERIOD)
            now = time.monotonic()
            if now - last > _NOTICED + _PERIOD:
                woken = time.time_ns()
                late.append(Stall(woken - round((now - last - _PERIOD) * 1e9), woken))
            last = now
        last = time.monotonic()  # the look itself is no stall
    pipe.send(late)


def withheld(spans: Sequence[tuple[int, int]], stalls: Sequence[Stall]) -> Array:
    """Return how much of each piece of work's time the machine withheld [ns], shape (n,).

    Work that comes while other work is done waits for it, and so for what held that up: stalls
    count from when there was last nothing to do.

    Args:
        spans: when each piece came and was done [ns], in the order they came.
        stalls: when the core was withheld [ns].
    """
    since, ended = [], []
    for came, done in spans:
        since.append(since[-1] if ended and came < ended[-1] else came)
        ended.append(done)
    if not spans or not stalls:
        return np.zeros(len(spans))
    # What had been withheld until a time: rises during stalls, and only then.
    start = stalls[0].due
    times = np.array(stalls, dtype=np.int64).ravel() - start
    lost = np.cumsum(np.diff(times, prepend=0) * (np.arange(len(times)) % 2))
    before, after = (np.array(t, dtype=np.int64) - start for t in (since, ended))
    return np.interp(after, times, lost) - np.interp(before, times, lost)
