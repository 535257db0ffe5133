"""Where a stream comes from or goes to, and who may send one."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from actuator_glue.errors import InputError


@dataclass(frozen=True, slots=True)
class Address:
    """An end of a stream.

    Attributes:
        scheme: transport: udp, tcp, lsl or openfresco.
        host: IP address or name; empty where the scheme has none.
        port: port; 0 where the scheme has none.
        name: name of a stream that is found by name, as of lsl.
    """

    scheme: str
    host: str = ''
    port: int = 0
    name: str = ''

    def __str__(self) -> str:
        if self.name:
            return f'{self.scheme}:{self.name}'
        host = f'[{self.host}]' if ':' in self.host else self.host
        return f'{self.scheme}://{host}:{self.port}'

    @property
    def loopback(self) -> bool:
        """Whether nothing but this machine can reach it."""
        try:
            return self.host == 'localhost' or ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False


def parse_address(text: str, schemes: Sequence[str]) -> Address:
    """Return the address that `udp://HOST:PORT` or `lsl:NAME` says.

    Raises:
        InputError: a scheme that is not possible here, no host, no port.
    """
    forms = ', '.join('lsl:NAME' if s == 'lsl' else f'{s}://HOST:PORT' for s in schemes)
    scheme, colon, rest = text.partition(':')
    if not colon or scheme not in schemes:
        raise InputError(f'{text!r} is no address of a stream; use one of {forms}')
    if scheme == 'lsl':
        name = rest.removeprefix('//')
        if not name or len(name) > 200 or not name.isprintable() or "'" in name:
            raise InputError(f'{text!r}: give the name of the stream, as in lsl:servo')
        return Address(scheme, name=name)
    if not rest.startswith('//'):
        raise InputError(f'{text!r}: write it as {scheme}://HOST:PORT')
    host, port = host_port(rest[2:], text)
    return Address(scheme, host, port)


def host_port(text: str, where: str) -> tuple[str, int]:
    """Return the two of `HOST:PORT`, an IPv6 address in brackets.

    Raises:
        InputError: either is missing or impossible.
    """
    host, colon, port = text.rpartition(':')
    host = host.removeprefix('[').removesuffix(']')
    if not colon or not host or any(c.isspace() or c in '/@' for c in host):
        raise InputError(f'{where!r}: HOST:PORT is needed, as in 127.0.0.1:5005')
    if not (port.isascii() and port.isdigit() and len(port) <= 5 and 0 < int(port) < 65_536):
        raise InputError(f'{where!r}: {port!r} is no port; use one from 1 to 65535')
    return host, int(port)


class Allowed:
    """Which senders are listened to.

    Args:
        entries: IP addresses and networks (192.168.7.0/24); none for this machine alone.

    Raises:
        InputError: an entry is neither.
    """

    def __init__(self, entries: Sequence[str] = ()) -> None:
        try:
            networks = [ipaddress.ip_network(entry) for entry in entries]
        except ValueError as error:
            raise InputError(
                f'allow: {error}; give IP addresses or networks such as 192.168.7.0/24'
            ) from error
        self.entries = tuple(entries)

        @lru_cache(maxsize=256)
        def known(host: str) -> bool:
            address = ipaddress.ip_address(host.partition('%')[0])
            mapped = getattr(address, 'ipv4_mapped', None)
            address = mapped or address
            if not networks:
                return address.is_loopback
            return any(address in network for network in networks)

        self._known = known

    def __contains__(self, host: str) -> bool:
        return self._known(host)

    def check(self, address: Address) -> None:
        """Refuse to listen beyond this machine without saying to whom.

        Raises:
            InputError: the address is no loopback one and no sender is allowed.
        """
        if address.host and not address.loopback and not self.entries:
            raise InputError(
                f'{address} can be reached from other machines; say which may send, as in '
                "allow:=['192.168.7.2'], or listen to 127.0.0.1"
            )
