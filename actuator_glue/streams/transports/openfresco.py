"""A shadow of OpenFresco's wire: relays between client and site unchanged, and takes a copy.

The client sends 11 int32 (sizes of control and measured displacement, velocity, acceleration,
force, time; doubles per message), then messages of that many doubles, the first an action: 3 sets
the trial, 6 asks for what was measured, 6 to 15 are answered by one message, 99 ends.
"""

from __future__ import annotations

import select
import socket
import struct
import threading
from collections import Counter, deque
from contextlib import suppress
from dataclasses import replace

import numpy as np

from actuator_glue.errors import InputError
from actuator_glue.records import Array
from actuator_glue.streams import sockets
from actuator_glue.streams.address import Address, host_port
from actuator_glue.streams.layout import Layout, Rows
from actuator_glue.streams.lines import places
from actuator_glue.streams.transports import AT_ONCE, Terms, Transport, no_seal

SET_TRIAL, GET_DAQ, ANSWERED, END = 3, 6, range(6, 16), 99
KINDS = ('disp', 'vel', 'accel', 'force', 'time')
# Column of a field that names none.
USUAL = {
    'command': 'ctrl_disp_1',
    'measured': 'daq_disp_1',
    'force': 'daq_force_1',
    'time': 'ctrl_time_1',
}
COUNTED = (
    'messages',
    'connections',
    'malformed',
    'overruns',
    'senders refused',
    'site unreachable',
)
LARGEST = 4096  # doubles of a message
_CHUNK = 1 << 16
_PENDING = 1 << 20  # bytes on their way to a side that does not read
_UNANSWERED = 64


class Copy:
    """Reads what passes between client and site; raises nothing, whatever passes.

    Attributes:
        lost: the bytes made no sense, and are no longer read until another client begins.
    """

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._order = '<' if layout.byte_order == 'little' else '>'
        self._client = self._site = b''
        self._size = 0
        self._asked: deque[int] = deque()
        self._trial: Array = np.empty(0)
        self._at: dict[str, int] = {}
        self.lost = False

    def from_client(self, data: bytes) -> None:
        """Read what the client says."""
        if self.lost:
            return
        self._client += data
        if not self._size and len(self._client) >= 44:
            self._begin(struct.unpack(f'{self._order}11i', self._client[:44]))
            self._client = self._client[44:]
        while not self.lost and self._size and len(self._client) >= self._size * 8:
            message = np.frombuffer(self._client[: self._size * 8], f'{self._order}f8')
            self._client = self._client[self._size * 8 :]
            action = int(message[0]) if abs(message[0]) < 1e6 else 0
            if action == SET_TRIAL:
                self._trial = message[1:]
            elif action in ANSWERED:
                self._asked.append(action)
                self.lost = len(self._asked) > _UNANSWERED
        if self.lost:
            self._client = self._site = b''

    def from_site(self, data: bytes) -> list[dict[str, float]]:
        """Return the samples in what the site answers, values as sent."""
        found: list[dict[str, float]] = []
        if self.lost or not self._size:
            return found
        self._site += data
        while len(self._site) >= self._size * 8:
            message = np.frombuffer(self._site[: self._size * 8], f'{self._order}f8')
            self._site = self._site[self._size * 8 :]
            if not self._asked:
                self.lost = True
                break
            if self._asked.popleft() == GET_DAQ and len(self._trial):
                both = np.concatenate([self._trial[: self._controls], message])
                found.append({name: float(both[at]) for name, at in self._at.items()})
        return found

    def _begin(self, words: tuple[int, ...]) -> None:
        sizes, size = words[:10], words[10]
        self._controls = sum(sizes[:5])
        fits = 0 < size <= LARGEST and all(0 <= s < size for s in sizes)
        if not fits or max(self._controls + 1, sum(sizes[5:])) > size:
            self.lost = True
            return
        names = [
            f'{side}_{kind}_{i + 1}'
            for side, counts in (('ctrl', sizes[:5]), ('daq', sizes[5:]))
            for kind, count in zip(KINDS, counts, strict=True)
            for i in range(count)
        ]
        try:
            self._at = places(self._layout, names)
        except LookupError:
            self.lost = True
            return
        self.lost = max(self._at.values()) >= len(names)
        self._size = size


class Shadow:
    """Relays in a thread of its own, so that the test never waits for what reads the copy."""

    def __init__(self, address: Address, terms: Terms) -> None:
        no_seal(address, terms)
        terms.allowed.check(address)
        layout = terms.layout
        if not layout.forward:
            raise InputError(
                f'{layout.source or address}: a shadow needs `forward: HOST:PORT` in the layout, '
                'the site that OpenFresco controls'
            )
        self._site_at = Address('tcp', *host_port(layout.forward, layout.forward))
        self._terms, self._layout = terms, usual(layout)
        # All names from the start: they are read while the thread counts.
        self.hint = ''
        self.counts: Counter[str] = Counter(dict.fromkeys(COUNTED, 0))
        self._found: deque[Rows] = deque(maxlen=AT_ONCE)
        self._came = threading.Event()
        self._ended = threading.Event()
        self._server = sockets.bound(address, socket.SOCK_STREAM)
        self._thread = threading.Thread(target=self._run, name='shadow', daemon=True)
        self._thread.start()

    def receive(self, timeout: float) -> list[Rows]:
        """Return the samples that have passed."""
        self._came.wait(timeout)
        self._came.clear()
        return [self._found.popleft() for _ in range(len(self._found))]

    def close(self) -> None:
        """End the relay; a test that runs through it ends as well."""
        self._ended.set()
        self._thread.join(2.0)
        sockets.closed(self._server)

    def _run(self) -> None:
        while not self._ended.is_set():
            ready, _, _ = select.select([self._server], [], [], 0.1)
            if not ready:
                continue
            try:
                client, where = self._server.accept()
            except OSError:
                continue
            if str(where[0]) not in self._terms.allowed:
                self.counts['senders refused'] += 1
                client.close()
                continue
            try:
                site = sockets.connected(self._site_at, socket.SOCK_STREAM)
            except InputError:
                self.counts['site unreachable'] += 1
                client.close()
                continue
            self.counts['connections'] += 1
            with suppress(OSError):
                self._relay(client, site)
            sockets.closed(client, site)

    def _relay(self, client: socket.socket, site: socket.socket) -> None:
        copy, fresh, told = Copy(self._layout), True, False
        waiting = {client: bytearray(), site: bytearray()}  # on the way to each
        other = {client: site, site: client}
        for end in other:
            end.setblocking(False)
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while not self._ended.is_set():
            reading = [end for end in other if len(waiting[other[end]]) < _PENDING]
            ready, free, _ = select.select(reading, [e for e in other if waiting[e]], [], 0.1)
            for end in ready:
                data, to = end.recv(_CHUNK), other[end]
                if not data:
                    # What was said last is still on its way.
                    to.settimeout(1.0)
                    to.sendall(waiting[to])
                    return
                waiting[to] += data
                free = [*free, to]
                if end is client:
                    copy.from_client(data)
                else:
                    for found in copy.from_site(data):
                        fresh = self._keep(found, fresh)
            for end in set(free):
                with suppress(BlockingIOError):
                    del waiting[end][: end.send(waiting[end])]
            if copy.lost and not told:
                told = True
                self.counts['malformed'] += 1

    def _keep(self, found: dict[str, float], fresh: bool) -> bool:
        """Hand a sample over; return whether the next one is still the first of its client."""
        values = {name: np.array([value]) for name, value in found.items()}
        terms = self._terms
        rows, left_out = self._layout.rows(values, terms.now_ns(), terms.rate, fresh)
        self.counts['malformed'] += left_out.total()
        if left_out.total():
            return fresh
        self.counts['messages'] += 1
        self.counts['overruns'] += len(self._found) == AT_ONCE
        self._found.append(rows)
        self._came.set()
        return False


def usual(layout: Layout) -> Layout:
    """Return a layout whose fields all name their columns."""
    sample = tuple(
        replace(f, column=USUAL.get(f.name, f.name)) if f.column is None else f
        for f in layout.sample
        if f.role
    )
    return replace(layout, sample=sample)


TRANSPORT = Transport('openfresco', Shadow, None, in_order=True)
