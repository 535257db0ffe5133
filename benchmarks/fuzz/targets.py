"""What is fuzzed: the bytes it begins with, and what is done with those that come of them."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from actuator_glue import sample_block, setups
from actuator_glue.errors import InputError
from actuator_glue.inference.choice import choose_model
from actuator_glue.io.bag_reader import messages
from actuator_glue.io.messages import deserialize
from actuator_glue.io.partition import read_partition
from actuator_glue.io.yaml_file import parse
from actuator_glue.online import conversion
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.streams.address import Allowed
from actuator_glue.streams.layout import PLAIN
from actuator_glue.streams.layout_file import parse_layout
from actuator_glue.streams.lines import Lines
from actuator_glue.streams.packed import Packed
from actuator_glue.streams.reception import Reception
from actuator_glue.streams.transports import Terms, source
from actuator_glue.streams.transports.openfresco import Copy, usual
from actuator_glue.view.history import History
from actuator_glue.view.intake import TYPES, Intake
from benchmarks.fuzz.files import FORMATS

ROOT = Path(__file__).resolve().parents[2]
Use = Callable[[bytes], None]


@dataclass(frozen=True, slots=True)
class Target:
    """One reader.

    Attributes:
        seeds: return good inputs, given a folder to work in.
        user: return what takes an input, given that folder; nothing but InputError may come out.
        words: pieces that random bytes would hardly make.
    """

    seeds: Callable[[Path], list[bytes]]
    user: Callable[[Path], Use]
    words: tuple[str, ...] = ()


def _file(name: str, words: tuple[str, ...]) -> Target:
    suffix, make, use = FORMATS[name]

    def seeds(folder: Path) -> list[bytes]:
        path = folder / f'good{suffix}'
        make(path)
        return [path.read_bytes()]

    def user(folder: Path) -> Use:
        path = folder / f'input{suffix}'

        def take(data: bytes) -> None:
            path.write_bytes(data)
            use(path)

        return take

    return Target(seeds, user, words)


def _text(folder: str, words: tuple[str, ...], use: Callable[[Path], object]) -> Target:
    def user(folder: Path) -> Use:
        path = folder / 'input.yaml'

        def take(data: bytes) -> None:
            path.write_bytes(data)
            use(path)

        return take

    return Target(
        lambda _: [p.read_bytes() for p in sorted((ROOT / folder).glob('*.yaml'))], user, words
    )


def _use_layout(path: Path) -> None:
    layout = parse_layout(parse(path.read_text('utf-8', errors='replace'), 'test'), 'test')
    rate = layout.rate or 1000.0
    packed = Packed(layout, rate)
    layout.rows(packed.decoded(bytes(packed.size)), 0, rate)
    Lines(layout).decoded([b'1,2,3'])


# Streams: through sockets of this machine, as from a controller.


def _stream(scheme: str, kind: socket.SocketKind) -> Callable[[Path], Use]:
    def user(_: Path) -> Use:
        with socket.socket(socket.AF_INET, kind) as probe:
            probe.bind(('127.0.0.1', 0))
            place = probe.getsockname()
        transport, address = source(f'{scheme}://127.0.0.1:{place[1]}')
        terms = Terms(PLAIN, 1000.0, time.time_ns, Allowed(()), None)
        listener = transport.listen(address, terms)
        line = socket.socket(socket.AF_INET, kind)
        line.connect(place)

        def take(data: bytes) -> None:
            nonlocal line
            try:
                # A datagram for each piece of 36 bytes and the rest; a line as it is.
                pieces = [data[at : at + 36] for at in range(0, len(data), 36)]
                for piece in pieces if scheme == 'udp' else [data + b'\n']:
                    line.sendall(piece)
            except OSError:  # the listener has hung up, as it should
                line.close()
                line = socket.socket(socket.AF_INET, kind)
                line.connect(place)
            reception = Reception(PLAIN, 1000.0, in_order=transport.in_order)
            for _ in range(2):
                for rows in listener.receive(0.0):
                    for samples in reception.push(rows, time.monotonic()):
                        assert 0 <= samples.index < 2**62
                        assert len(samples.command) == len(samples.measured) > 0

        return take

    return user


def _datagrams(_: Path) -> list[bytes]:
    rows = [struct.pack('<Idddd', n, n * 1e-3, 1.0, 2.0, 3.0) for n in (1, 2, 4, 3, 900, 0)]
    return [b''.join(rows), rows[0], rows[0][:20]]


def _lines(_: Path) -> list[bytes]:
    return [b'\n'.join(f'{n},{n * 1e-3:.3f},1,2,3'.encode() for n in range(5)), b'1;2;3', b'\0']


def _fresco(_: Path) -> Use:
    columns = [{'name': name, 'unit': 'm'} for name in ('command', 'measured')]
    layout = usual(parse_layout({'sample': columns}, 'test'))

    def take(data: bytes) -> None:
        copy = Copy(layout)
        half = len(data) // 2
        copy.from_client(data[:half])
        copy.from_site(data[half:])

    return take


def _handshakes(_: Path) -> list[bytes]:
    hello = struct.pack('<11i', *range(1, 12)) + struct.pack('<16d', *range(16))
    return [hello, 2 * hello, struct.pack('<11i', 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 16) + bytes(256)]


# Messages: as a bag or the network carries them.


def _recorded(_: Path) -> list[bytes]:
    found: dict[str, bytes] = {}
    for message in messages(ROOT / 'bags' / 'session'):
        found.setdefault(message.type, message.data)
    kinds = _kinds()
    return [
        bytes([kinds.index(name)]) + data
        for kind, data in found.items()
        if (name := kind.rpartition('/')[2]) in kinds and len(data) < 20_000
    ]


def _kinds() -> list[str]:
    return sorted({*TYPES, 'CommandPreview', 'EstimatorSetup', 'PosteriorDraws'})


def _messages(_: Path) -> Use:
    intake = Intake(History(4096), 'fuzz', live=True)
    kinds = _kinds()

    def take(data: bytes) -> None:
        estimator = Estimator(EstimatorSettings(), choose_model([]), live=True)
        kind = kinds[data[0] % len(kinds)] if data else 'SampleBlock'
        package = 'diagnostic_msgs/msg/' if kind == 'DiagnosticArray' else ''
        message = deserialize(package + kind, data[1:])
        uses: list[Callable[[], object]] = []
        if kind in TYPES:
            uses.append(lambda: intake.take(kind, message))
        if kind == 'SampleBlock':
            uses.append(lambda: estimator.push(sample_block.from_message(message)))
        elif kind == 'TestSetup':
            uses.append(lambda: estimator.setup(setups.from_message(message)))
        elif kind == 'CommandPreview':
            uses.append(lambda: estimator.preview(conversion.preview(message)))
        elif kind == 'EstimatorSetup':
            uses += [
                lambda: conversion.estimator_settings(message),
                lambda: conversion.carried(message),
                lambda: conversion.model_choice(message),
            ]
        for use in uses:
            with suppress(InputError):
                use()

    return take


_YAML = ('{', '}', '[', ']', ': ', '- ', '&a ', '*a', '!!', '.nan', '.inf', '1e999', '|', '<<: ')
_MAP = (*_YAML, 'column', 'unit', 'scale', 'rate', 'command', 'measured', 'stiffness', 'hold')
_EFFECTS = (*_YAML, 'sensor', 'parameters', 'bounds', 'neutral', 'meaning', '**', 'tanh(', 'y = ')
_LAYOUT = (*_YAML, 'sample', 'packet', 'name', 'type', 'count', 'float64', 'counter', 'samples')
_CSV = (',', ';', '\t', '"', '\r\n', '#', 'nan', 'inf', '1e999', '1,5', '\ufeff', 'time', 'mm')

TARGETS: dict[str, Target] = {
    'csv': _file('csv', _CSV),
    'map': _file('map', _MAP),
    'effects': _file('effects', _EFFECTS),
    'mat': _file('mat', ('MATLAB 5.0 MAT-file', 'IM', 'MI')),
    'mat_6': _file('mat_6', ('MATLAB 5.0 MAT-file', 'IM', 'MI')),
    'hdf5': _file('hdf5', ('TREE', 'SNOD', 'HEAP', 'OHDR')),
    'tdms': _file('tdms', ('TDSm', 'TDSh', 'NI_Scale', 'wf_increment')),
    'parquet': _file('parquet', ('PAR1',)),
    'excel': _file('excel', ('PK', 'xl/worksheets/sheet1.xml')),
    'mcap': _file('mcap', ('MCAP0', 'ros2msg', 'cdr')),
    'layout': _text('config/layouts', _LAYOUT, _use_layout),
    'partition': _text('config/partitions', _YAML, read_partition),
    'datagrams': Target(_datagrams, _stream('udp', socket.SOCK_DGRAM)),
    'lines': Target(_lines, _stream('tcp', socket.SOCK_STREAM), _CSV),
    'openfresco': Target(_handshakes, _fresco),
    'messages': Target(_recorded, _messages),
}
