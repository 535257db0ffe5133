"""Transports of streams: each file of this folder is one, found by the scheme it names.

A transport is a module with `TRANSPORT`; addresses, node parameter and `send` follow from it.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

from numpy.typing import NDArray

from actuator_glue.errors import InputError
from actuator_glue.records import Array
from actuator_glue.streams.address import Address, Allowed, parse_address
from actuator_glue.streams.layout import Layout, Rows
from actuator_glue.streams.seal import Seal

# Messages taken at once at most: what holds up the receiver must not fill memory.
AT_ONCE = 4096


@dataclass(frozen=True, slots=True)
class Terms:
    """What a listener listens by.

    Attributes:
        layout: what a message holds.
        rate: sample rate [Hz].
        now_ns: clock by which arrivals are told [ns].
        allowed: who may send.
        seal: key of signed messages, or None.
    """

    layout: Layout
    rate: float
    now_ns: Callable[[], int]
    allowed: Allowed
    seal: Seal | None = None


class Listener(Protocol):
    """Receives a stream; no message, whatever it holds, makes it raise.

    Attributes:
        counts: what was received and refused, by name.
        hint: how the last message that is malformed differs from the layout; may be empty.
    """

    counts: Counter[str]
    hint: str

    def receive(self, timeout: float) -> list[Rows]:
        """Return what has arrived, waiting for it no longer than so many seconds."""

    def close(self) -> None:
        """Let go of sockets."""


def samples(
    listener: Listener, terms: Terms, values: Mapping[str, NDArray[Any]], fresh: bool = False
) -> Rows:
    """Return the samples of what a listener has received; what is left out it counts.

    Args:
        listener: who has received it, just now.
        terms: the terms it listens by.
        values: by field, as sent, each of shape (n,).
        fresh: whether a connection begins with them.
    """
    rows, left_out = terms.layout.rows(values, terms.now_ns(), terms.rate, fresh)
    listener.counts.update(left_out)
    if left_out['malformed']:
        listener.hint = 'counter or time of the last one is no number'
    return rows


class Sender(Protocol):
    """Sends a stream.

    Attributes:
        unheard: messages that are known to have reached nobody.
    """

    unheard: int

    def send(self, values: Mapping[str, Array]) -> int:
        """Send consecutive samples (SI units by field); return how many messages.

        Raises:
            InputError: the other side has gone.
        """

    def close(self) -> None:
        """Let go of sockets."""


@dataclass(frozen=True, slots=True)
class Transport:
    """One transport; both functions raise `InputError`.

    Attributes:
        scheme: of its addresses.
        listen: begin to listen at an address.
        connect: begin to send to an address; None where nothing is sent.
        in_order: whether it delivers everything, and in order.
    """

    scheme: str
    listen: Callable[[Address, Terms], Listener]
    connect: Callable[[Address, Terms], Sender] | None
    in_order: bool


@cache
def transports() -> dict[str, Transport]:
    """Return every transport by its scheme."""
    modules = sorted(module.name for module in pkgutil.iter_modules(__path__))
    found = [importlib.import_module(f'{__name__}.{name}').TRANSPORT for name in modules]
    return {entry.scheme: entry for entry in found}


def source(text: str) -> tuple[Transport, Address]:
    """Return transport and address of a source.

    Raises:
        InputError: no such address.
    """
    address = parse_address(text, tuple(transports()))
    return transports()[address.scheme], address


def target(text: str) -> tuple[Callable[[Address, Terms], Sender], Address]:
    """Return how to connect to an address, and the address.

    Raises:
        InputError: no such address, or nothing can be sent there.
    """
    schemes = tuple(name for name, entry in transports().items() if entry.connect)
    address = parse_address(text, schemes)
    connect = transports()[address.scheme].connect
    assert connect is not None
    return connect, address


def no_seal(address: Address, terms: Terms) -> None:
    """Refuse a key where messages cannot be signed.

    Raises:
        InputError: there is one.
    """
    if terms.seal is not None:
        raise InputError(f'{address}: {address.scheme} carries no signatures; use udp or tcp')
