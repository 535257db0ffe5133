"""TCP lines of text, one sample each: LabVIEW, NI, MTS."""

from __future__ import annotations

import select
import socket
import time
from collections import Counter
from collections.abc import Mapping

from actuator_glue.errors import InputError
from actuator_glue.records import Array
from actuator_glue.streams import sockets
from actuator_glue.streams.address import Address
from actuator_glue.streams.layout import Rows
from actuator_glue.streams.lines import LONGEST, Lines
from actuator_glue.streams.transports import Terms, Transport, samples

# Read at once at most [bytes]; what is not read holds up the sender, not our memory.
CHUNK = 1 << 16
# A connection that said nothing for so long gives way to another [s].
SILENT = 1.0


class TcpListener:
    """Receives lines from one connection at a time."""

    def __init__(self, address: Address, terms: Terms) -> None:
        terms.allowed.check(address)
        self.counts: Counter[str] = Counter()
        self.hint = ''
        self._terms = terms
        self._lines = Lines(terms.layout)
        self._server = sockets.bound(address, socket.SOCK_STREAM)
        self._peer: socket.socket | None = None
        self._heard = 0.0
        self._rest = b''
        self._fresh = False

    def receive(self, timeout: float) -> list[Rows]:
        """Return the samples of all lines that have arrived, a chunk at most."""
        watched = [s for s in (self._server, self._peer) if s is not None]
        ready, _, _ = select.select(watched, [], [], timeout)
        rows = self._read() if self._peer is not None and self._peer in ready else []
        # A partner that comes back is no second one: first the end of the old connection is read.
        if self._server in ready and not self._waits():
            self._accept()
        return rows

    def _waits(self) -> bool:
        """Whether something of the connection, maybe its end, is still to be read."""
        return self._peer is not None and bool(select.select([self._peer], [], [], 0.0)[0])

    def _read(self) -> list[Rows]:
        assert self._peer is not None
        try:
            data = self._peer.recv(CHUNK)
        except BlockingIOError:
            return []
        except OSError:
            data = b''
        if not data:
            self._hang_up()
            return []
        self._heard = time.monotonic()
        # A carriage return ends a line, too: none is within one.
        *lines, self._rest = (self._rest + data.replace(b'\r', b'\n')).split(b'\n')
        if len(self._rest) > LONGEST or any(len(line) > LONGEST for line in lines):
            self.counts['malformed'] += 1
            self.hint = f'no line ends within {LONGEST} bytes; end each with a line feed'
            self._hang_up()
            return []
        return self._rows([line for line in lines if line.strip()])

    def _rows(self, lines: list[bytes]) -> list[Rows]:
        if self._terms.seal is not None:
            opened = [self._terms.seal.opened_line(line.rstrip()) for line in lines]
            lines = [line for line in opened if line is not None]
            self.counts['not authentic'] += len(opened) - len(lines)
        if not lines:
            return []
        values, bad = self._lines.decoded(lines)
        self.counts['malformed'] += bad
        self.hint = self._lines.odd or self.hint
        if 'command' not in values or not len(values['command']):
            return []
        self.counts['messages'] += len(values['command'])
        rows = samples(self, self._terms, values, self._fresh)
        self._fresh = False
        return [rows]

    def _accept(self) -> None:
        try:
            peer, where = self._server.accept()
        except OSError:
            return
        if str(where[0]) not in self._terms.allowed:
            self.counts['senders refused'] += 1
            peer.close()
            return
        if self._peer is not None and time.monotonic() - self._heard < SILENT:
            self.counts['second sender'] += 1
            peer.close()
            return
        self._hang_up()
        peer.setblocking(False)
        self._peer, self._fresh, self._heard = peer, True, time.monotonic()
        self.counts['connections'] += 1

    def _hang_up(self) -> None:
        sockets.closed(self._peer)
        self._peer, self._rest = None, b''
        self._lines.begin()

    def close(self) -> None:
        """Close the sockets."""
        sockets.closed(self._peer, self._server)


class TcpSender:
    """Sends a line per sample."""

    unheard = 0

    def __init__(self, address: Address, terms: Terms) -> None:
        self._address = address
        self._lines = Lines(terms.layout)
        self._seal = terms.seal
        self._socket = sockets.connected(address, socket.SOCK_STREAM)
        if terms.layout.header or self._lines.by_name:
            self._put([self._lines.head()])

    def send(self, values: Mapping[str, Array]) -> int:
        """Send the lines of consecutive samples."""
        lines = self._lines.encoded(values)
        self._put(lines)
        return len(lines)

    def _put(self, lines: list[bytes]) -> None:
        if self._seal is not None:
            lines = [line + b' ' + self._seal.sign(line).hex().encode() for line in lines]
        try:
            self._socket.sendall(b''.join(line + b'\n' for line in lines))
        except OSError as error:
            raise InputError(
                f'{self._address}: the other side has gone ({error.strerror or error})'
            ) from error

    def close(self) -> None:
        """Close the connection, once everything is on its way."""
        sockets.closed(self._socket)


TRANSPORT = Transport('tcp', TcpListener, TcpSender, in_order=True)
