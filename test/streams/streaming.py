"""Records, layouts and ports for tests of streams."""

import socket
import time
from contextlib import closing

import numpy as np

from actuator_glue.records import Record
from actuator_glue.streams.address import Allowed
from actuator_glue.streams.layout import PLAIN
from actuator_glue.streams.layout_file import parse_layout
from actuator_glue.streams.reception import Reception
from actuator_glue.streams.transports import Terms, source, target


def free_port(kind=socket.SOCK_DGRAM):
    """Port of this machine that nobody uses."""
    with closing(socket.socket(socket.AF_INET, kind)) as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def record(samples=500, rate=1000.0, seed=0):
    """Record whose every sample is another."""
    rng = np.random.default_rng(seed)
    command = 1e-3 * rng.standard_normal(samples)
    return Record(command, 0.9 * command + 1e-6, 1.0 / rate, 1e5, force=1e5 * command)


def layout(sample, **entries):
    """Layout of fields given as dictionaries."""
    return parse_layout({'sample': sample, **entries}, 'test')


def terms(layout=PLAIN, rate=1000.0, seal=None, allow=()):
    return Terms(layout, rate, time.time_ns, Allowed(allow), seal)


def listen(address, its=None):
    transport, where = source(address)
    return transport.listen(where, its or terms())


def connect(address, its=None):
    connector, where = target(address)
    return connector(where, its or terms())


def received(listener, count, reception=None, timeout=60.0):
    """Samples that a listener and a reception make of what comes, up to a count."""
    reception = reception or Reception(PLAIN, 1000.0)
    found, end = [], time.monotonic() + timeout
    while sum(len(s.command) for s in found) < count and time.monotonic() < end:
        for rows in listener.receive(0.05):
            found += reception.push(rows, time.monotonic())
        found += reception.waited(time.monotonic(), time.time_ns())
    return found


def counted(listener, name):
    """Take what comes until a listener has counted it; return the messages that it let through."""
    found, end = [], time.monotonic() + 60.0
    while not listener.counts[name]:
        assert time.monotonic() < end, f'nothing is {name}'
        found += listener.receive(0.05)
    return found


def joined(found):
    """Indices, command, measured and force of samples."""
    index = np.concatenate([s.index + np.arange(len(s.command)) for s in found])
    force = None if found[0].force is None else np.concatenate([s.force for s in found])
    command = np.concatenate([s.command for s in found])
    return index, command, np.concatenate([s.measured for s in found]), force
