"""`send`: what was sent is told, and what cannot be sent is refused with a reason."""

import json
import socket
import struct
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from actuator_glue.cli.main import main
from actuator_glue.io.export import write
from actuator_glue.records import Record

LAYOUTS = Path(__file__).resolve().parents[2] / 'config' / 'layouts'


@pytest.fixture
def csv(tmp_path):
    """A record of 200 samples at 1 kHz without force."""
    command = 1e-3 * np.sin(np.arange(200) / 10)
    path = tmp_path / 'test.csv'
    write(path, Record(command, 0.9 * command, 1e-3, 1e5))
    return path


def test_every_sample_leaves_as_a_datagram(csv, capsys):
    with closing(socket.socket(type=socket.SOCK_DGRAM)) as receiver:
        receiver.bind(('127.0.0.1', 0))
        port = receiver.getsockname()[1]
        to = f'udp://127.0.0.1:{port}'
        code = main(['send', str(csv), '--to', to, '--speed', '5', '--json', '-'])
        out, err = capsys.readouterr()
        found = [struct.unpack('<Idddd', receiver.recv(100)) for _ in range(200)]
    sent = json.loads(out)
    assert code == (0 if sent['kept_up'] else 1)
    assert (
        sent['samples'] == sent['messages'] == 200
        and f'200 samples in 200 messages to {to}' in err
    )
    assert [f[0] for f in found] == list(range(200))
    assert np.allclose([f[1] for f in found], np.arange(200) / 1000)
    assert np.allclose([f[2] for f in found], 1e-3 * np.sin(np.arange(200) / 10), atol=1e-9)


def test_datagrams_to_nobody_are_told(csv, capsys):
    with closing(socket.socket(type=socket.SOCK_DGRAM)) as free:
        free.bind(('127.0.0.1', 0))
        port = free.getsockname()[1]
    main(['send', str(csv), '--to', f'udp://127.0.0.1:{port}'])
    assert 'nobody listened' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('options', 'told'),
    [
        (['--to', 'openfresco://127.0.0.1:1'], 'no address of a stream'),
        (['--to', 'tcp://127.0.0.1:1'], 'does anybody listen there'),
        (['--to', 'udp://127.0.0.1:1', '--speed', '-1'], 'is negative'),
        (['--to', 'udp://127.0.0.1:1', '--layout', 'none.yaml'], 'layout cannot be read'),
        (['--to', 'udp://127.0.0.1:1', '--key-file', 'none'], 'key file cannot be read'),
        (
            ['--to', 'udp://127.0.0.1:1', '--layout', str(LAYOUTS / 'speedgoat.yaml')],
            'says 2000 Hz; write `rate: ',
        ),
        (
            ['--to', 'tcp://127.0.0.1:1', '--layout', str(LAYOUTS / 'labview_tcp.yaml')],
            'no force, but',
        ),
    ],
)
def test_what_cannot_be_sent_is_refused(options, told, csv, capsys):
    assert main(['send', str(csv), *options]) == 2
    assert told in capsys.readouterr().err
