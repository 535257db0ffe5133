"""Results on their way back to a controller: packed doubles by UDP, or a stream of LSL."""

from __future__ import annotations

import socket
import struct
from collections.abc import Mapping
from typing import Any, Protocol

from actuator_glue.errors import InputError
from actuator_glue.streams import sockets
from actuator_glue.streams.address import Address, Allowed, parse_address
from actuator_glue.streams.seal import Seal

# A controller reads them by place: new ones go to the end.
FIELDS = (
    'window',
    'time',
    'delay',
    'amplitude',
    'phase',
    'frequency',
    'beta_1_mean',
    'alpha_1_beta_0_mean',
    'alpha_2_mean',
    'alpha_3_mean',
    'beta_1_stddev',
    'alpha_1_beta_0_stddev',
    'alpha_2_stddev',
    'alpha_3_stddev',
    'rhat_max',
    'coverage',
    'p_unstable',
    'p_unstable_upper',
)
UNITS = {
    'time': 's',
    'delay': 's',
    'phase': 'rad',
    'frequency': 'Hz',
    'beta_1': '1/s',
    'alpha_1_beta_0': 'N/(m s^2)',
    'alpha_2': 'N/m',
    'alpha_3': '1/s',
}


class ResultsSender(Protocol):
    """Sends one set of results at a time; never waits for who reads them."""

    def send(self, values: Mapping[str, float]) -> bool:
        """Send what is known, NaN for what is not; return whether it left."""

    def close(self) -> None:
        """Let go of sockets."""


class UdpResults:
    """One datagram of little-endian doubles per set of results."""

    def __init__(self, address: Address, seal: Seal | None) -> None:
        self._seal = seal
        self._socket = sockets.connected(address, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send(self, values: Mapping[str, float]) -> bool:
        """Send a datagram."""
        data = struct.pack(
            f'<{len(FIELDS)}d', *(values.get(name, float('nan')) for name in FIELDS)
        )
        try:
            self._socket.send(data if self._seal is None else data + self._seal.sign(data))
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Close the socket."""
        sockets.closed(self._socket)


class LslResults:
    """One sample of a stream of doubles per set of results."""

    def __init__(self, address: Address, hosts: tuple[str, ...]) -> None:
        from actuator_glue.streams.transports.lsl import library

        lsl = library(hosts)
        info = lsl.StreamInfo(
            address.name, 'results', len(FIELDS), 0.0, 'double64', f'{address.name}-results'
        )
        info.set_channel_labels(list(FIELDS))
        info.set_channel_units([unit(name) for name in FIELDS])
        self._outlet: Any = lsl.StreamOutlet(info)

    def send(self, values: Mapping[str, float]) -> bool:
        """Send a sample."""
        self._outlet.push_sample([float(values.get(name, float('nan'))) for name in FIELDS])
        return bool(self._outlet.have_consumers())

    def close(self) -> None:
        """Withdraw the stream."""
        self._outlet = None


def unit(name: str) -> str:
    """Return the unit of a field, 1 where it has none."""
    return UNITS.get(name.removesuffix('_mean').removesuffix('_stddev'), '1')


def connect(text: str, seal: Seal | None, allowed: Allowed) -> ResultsSender:
    """Return a sender of results.

    Args:
        text: udp://HOST:PORT or lsl:NAME.
        seal: signs datagrams, or None.
        allowed: beyond this machine, results go to hosts that are allowed only.

    Raises:
        InputError: no such address, or one beyond this machine that is not allowed.
    """
    address = parse_address(text, ('udp', 'lsl'))
    if address.scheme == 'lsl':
        if seal is not None:
            raise InputError(f'{address}: lsl carries no signatures; use udp')
        return LslResults(address, allowed.entries)
    _, where = sockets.resolved(address, socket.SOCK_DGRAM)
    if str(where[0]) not in allowed:
        raise InputError(
            f'{address} is another machine; name it in allow as well, so that results leave '
            'this one knowingly'
        )
    return UdpResults(address, seal)
