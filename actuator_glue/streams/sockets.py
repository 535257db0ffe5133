"""Sockets, with one clear message where one cannot be had."""

from __future__ import annotations

import socket
from contextlib import suppress

from actuator_glue.errors import InputError
from actuator_glue.streams.address import Address

# Asked of the system for what arrives while nobody reads; it may grant less (net.core.rmem_max).
RECEIVE_BYTES = 4 << 20


def resolved(address: Address, kind: socket.SocketKind) -> tuple[int, tuple[object, ...]]:
    """Return family and socket address of a host and port.

    Raises:
        InputError: the name is not known.
    """
    try:
        found = socket.getaddrinfo(address.host, address.port, type=kind)
    except (OSError, UnicodeError) as error:
        detail = getattr(error, 'strerror', None) or error
        raise InputError(f'{address}: the host is not known ({detail})') from error
    family, _, _, _, where = found[0]
    return family, where


def bound(address: Address, kind: socket.SocketKind) -> socket.socket:
    """Return a socket that listens at an address, not blocking.

    Raises:
        InputError: the port is taken, or the address is not this machine's.
    """
    family, where = resolved(address, kind)
    made = socket.socket(family, kind)
    try:
        if kind == socket.SOCK_STREAM:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BYTES)
        made.bind(where)
        if kind == socket.SOCK_STREAM:
            made.listen(4)
        made.setblocking(False)
    except OSError as error:
        made.close()
        raise InputError(
            f'{address}: cannot listen there ({error.strerror}); is another program listening, '
            "or is it another machine's address?"
        ) from error
    return made


def connected(address: Address, kind: socket.SocketKind, timeout: float = 5.0) -> socket.socket:
    """Return a socket connected to an address, blocking.

    Raises:
        InputError: nobody listens there.
    """
    family, where = resolved(address, kind)
    made = socket.socket(family, kind)
    try:
        made.settimeout(timeout)
        made.connect(where)
        if kind == socket.SOCK_STREAM:
            made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except OSError as error:
        made.close()
        raise InputError(
            f'{address}: cannot connect ({error.strerror or error}); does anybody listen there?'
        ) from error
    return made


def closed(*sockets: socket.socket | None) -> None:
    """Close sockets, whatever state they are in."""
    for one in sockets:
        if one is not None:
            with suppress(OSError):
                one.close()
