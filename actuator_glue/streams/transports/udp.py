"""UDP datagrams of packed values: Simulink Real-Time, Speedgoat, dSPACE."""

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
from actuator_glue.streams.packed import Packed
from actuator_glue.streams.seal import SIZE
from actuator_glue.streams.transports import AT_ONCE, Terms, Transport, samples

# One sender at a time: another is listened to when the first has been silent so long [s].
SILENT = 1.0
_LONGEST = 1 << 16  # bytes of a datagram


class UdpListener:
    """Receives datagrams of exactly one size from one sender at a time."""

    def __init__(self, address: Address, terms: Terms) -> None:
        terms.allowed.check(address)
        self.counts: Counter[str] = Counter()
        self._terms = terms
        self._packed = Packed(terms.layout, terms.rate)
        self._size = self._packed.size + (SIZE if terms.seal else 0)
        self._socket = sockets.bound(address, socket.SOCK_DGRAM)
        self._sender: object = None
        self.hint = ''
        self._heard = 0.0

    def receive(self, timeout: float) -> list[Rows]:
        """Return the samples of all datagrams that have arrived."""
        select.select([self._socket], [], [], timeout)
        payloads = []
        now = time.monotonic()
        for _ in range(AT_ONCE):
            try:
                # As long as it is, so that one of another size can be told.
                message, sender = self._socket.recvfrom(_LONGEST)
            except BlockingIOError:
                break
            except OSError:
                self.counts['socket errors'] += 1
                break
            payload = self._payload(message, sender, now)
            if payload is not None:
                payloads.append(payload)
        if not payloads:
            return []
        self.counts['messages'] += len(payloads)
        values = self._packed.decoded(b''.join(payloads))
        rows = samples(self, self._terms, values)
        return [rows] if len(rows.command) else []

    def _payload(self, message: bytes, sender: tuple[object, ...], now: float) -> bytes | None:
        """Return what a datagram carries; None, counted, where it is not for us."""
        if str(sender[0]) not in self._terms.allowed:
            self.counts['senders refused'] += 1
            return None
        if len(message) != self._size:
            self.counts['malformed'] += 1
            self.hint = f'the last one has {len(message)} bytes, the layout has {self._size}'
            return None
        payload: bytes | None = message
        if self._terms.seal is not None:
            payload = self._terms.seal.opened(message)
            if payload is None:
                self.counts['not authentic'] += 1
                return None
        if sender != self._sender:
            if self._sender is not None and now - self._heard < SILENT:
                self.counts['second sender'] += 1
                return None
            self._sender = sender
        self._heard = now
        return payload

    def close(self) -> None:
        """Close the socket."""
        sockets.closed(self._socket)


class UdpSender:
    """Sends one datagram per packet."""

    def __init__(self, address: Address, terms: Terms) -> None:
        self._address = address
        self._packed = Packed(terms.layout, terms.rate)
        self._seal = terms.seal
        self._socket = sockets.connected(address, socket.SOCK_DGRAM)
        self.unheard = 0

    def send(self, values: Mapping[str, Array]) -> int:
        """Send the packets of consecutive samples."""
        packets = self._packed.encoded(values)
        for packet in packets:
            data = packet if self._seal is None else packet + self._seal.sign(packet)
            try:
                self._socket.send(data)
            except ConnectionRefusedError:
                # The answer to an earlier one: nobody listens there yet, or any more.
                self.unheard += 1
            except OSError as error:
                raise InputError(f'{self._address}: cannot send ({error.strerror})') from error
        return len(packets)

    def close(self) -> None:
        """Close the socket."""
        sockets.closed(self._socket)


TRANSPORT = Transport('udp', UdpListener, UdpSender, in_order=False)
