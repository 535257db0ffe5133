"""Each transport over the loopback device: what is sent arrives, what is not for us does not."""

import socket
import struct
import threading
import time
from contextlib import closing, contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
from streaming import connect, counted, free_port, joined, layout, listen, received, record, terms

from actuator_glue.errors import InputError
from actuator_glue.streams.layout import PLAIN
from actuator_glue.streams.play import play
from actuator_glue.streams.reception import Reception
from actuator_glue.streams.seal import Seal
from actuator_glue.streams.transports import source

PLAIN_PAIR = [{'name': 'command', 'unit': 'mm'}, {'name': 'measured', 'unit': 'mm'}]
SEAL = Seal(b'a key of twenty byte')


def address(scheme):
    if scheme == 'lsl':
        pytest.importorskip('pylsl', reason='no pylsl: pip install "actuator_glue[lab]"')
        return f'lsl:test-{free_port()}'
    kind = socket.SOCK_DGRAM if scheme == 'udp' else socket.SOCK_STREAM
    return f'{scheme}://127.0.0.1:{free_port(kind)}'


def sent(at, its, what, speed=1.0):
    """Play a record in a thread, as another program would."""

    def work():
        with closing(connect(at, its)) as sender:
            play(what, its.layout, sender, speed)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread


@pytest.mark.parametrize(
    ('scheme', 'seal'),
    [
        ('udp', None),
        ('udp', SEAL),
        ('tcp', None),
        ('tcp', SEAL),
        ('lsl', None),
    ],
)
def test_a_record_arrives_bit_by_bit(scheme, seal):
    at, its, what = address(scheme), terms(seal=seal), record(600)
    order = source(at)[0].in_order
    reception = Reception(PLAIN, 1000.0, in_order=order, signed=seal is not None)
    with closing(listen(at, its)) as listener:
        thread = sent(at, its, what)
        found = received(listener, 600, reception)
        thread.join(60.0)
        index, command, measured, force = joined(found)
        assert np.array_equal(index, np.arange(600))
        assert np.array_equal(command, what.command)
        assert np.array_equal(measured, what.measured)
        assert np.array_equal(force, what.force)
        assert listener.counts['messages'] == 600
    assert not +reception.counts
    stamps = np.array([s.stamp_ns for s in found])
    assert (np.diff(stamps) > 0).all() and abs(stamps[0] * 1e-9 - time.time()) < 120.0


@pytest.mark.parametrize('scheme', ['tcp', 'lsl'])
@pytest.mark.parametrize('columns', [('cmd', 'pos'), (2, 1), ('cmd', 1)])
def test_what_is_sent_is_heard_by_the_same_layout(scheme, columns):
    """Names of columns were not sent, and numbers did not count."""
    pair = [{**field, 'column': column} for field, column in zip(PLAIN_PAIR, columns, strict=True)]
    at, its, what = address(scheme), terms(layout(pair, rate=1000)), record(60)
    reception = Reception(its.layout, 1000.0, in_order=True)
    with closing(listen(at, its)) as listener:
        thread = sent(at, its, what)
        _, command, measured, _ = joined(received(listener, 60, reception))
        thread.join(60.0)
    assert np.allclose(command, what.command, rtol=1e-14)
    assert np.allclose(measured, what.measured, rtol=1e-14)
    assert not listener.counts['malformed']


def test_datagrams_that_are_not_for_us_are_counted_and_left_out():
    at = address('udp')
    its = terms(seal=SEAL)
    port = int(at.rpartition(':')[2])
    with closing(listen(at, its)) as listener, closing(socket.socket(type=socket.SOCK_DGRAM)) as s:
        plain = struct.pack('<Idddd', 0, 0, 1, 1, 1)
        for wrong in (b'', b'x', plain, plain + bytes(32), plain * 3):
            s.sendto(wrong, ('127.0.0.1', port))
        s.sendto(plain + SEAL.sign(plain), ('127.0.0.1', port))
        found = received(listener, 1, Reception(PLAIN, 1000.0, signed=True))
        assert len(found) == 1
        assert listener.counts['malformed'] == 4 and listener.counts['not authentic'] == 1


def test_a_second_sender_is_heard_when_the_first_is_silent(monkeypatch):
    from actuator_glue.streams.transports import udp

    now = [0.0]
    monkeypatch.setattr(udp, 'time', SimpleNamespace(monotonic=lambda: now[0]))
    at, what = address('udp'), record(4)
    with closing(listen(at)) as listener, closing(connect(at)) as one, closing(connect(at)) as two:
        values = {
            'counter': np.arange(4.0),
            'time': what.time,
            'command': what.command,
            'measured': what.measured,
            'force': what.force,
        }
        one.send(values)
        assert sum(len(r.command) for r in listener.receive(1.0)) == 4
        two.send(values)
        assert listener.receive(0.1) == [] and listener.counts['second sender'] == 4
        now[0] += 1.1 * udp.SILENT
        two.send(values)
        assert sum(len(r.command) for r in listener.receive(1.0)) == 4


def test_a_sender_that_is_not_allowed_is_not_heard():
    for scheme in ('udp', 'tcp'):
        at = address(scheme)
        with closing(listen(at, terms(allow=('192.0.2.1',)))) as listener:
            sent(at, terms(), record(20)).join(60.0)
            assert counted(listener, 'senders refused') == []
            # Nor what else it sends.
            assert listener.receive(0.1) == []


def test_a_line_without_end_ends_the_connection_only():
    at = address('tcp')
    port = int(at.rpartition(':')[2])
    with closing(listen(at)) as listener:
        with closing(socket.create_connection(('127.0.0.1', port))) as hostile:
            hostile.sendall(b'9' * 100_000)
            assert counted(listener, 'malformed') == []
        assert listener.counts['malformed'] == 1 and len(listener._rest) == 0
        assert 'end each with a line feed' in listener.hint
        thread = sent(at, terms(), record(50))
        assert len(joined(received(listener, 50))[0]) == 50
        thread.join(60.0)


def test_a_broken_connection_without_counter_is_a_gap():
    bare = layout([{'name': n, 'unit': 'm'} for n in ('command', 'measured')])
    at, its = address('tcp'), terms(bare)
    reception = Reception(bare, 1000.0, in_order=True)
    with closing(listen(at, its)) as listener:
        sent(at, its, record(100), 0.0)
        begun = time.monotonic()
        first = received(listener, 100, reception)
        time.sleep(0.3)
        sent(at, its, record(50), 0.0)
        # The end of the old connection and the new one are there at once.
        time.sleep(0.3)
        second = received(listener, 50, reception)
        seconds = time.monotonic() - begun
    assert joined(first)[0].tolist() == list(range(100))
    assert reception.counts['interruptions'] == 1
    index = joined(second)[0]
    # A gap is a whole number of samples, rounded.
    assert 390 <= index[0] <= 100 + round(1000.0 * seconds)
    assert np.array_equal(np.diff(index), np.ones(49))


def test_a_taken_port_and_a_missing_partner_are_told():
    at = address('udp')
    with closing(listen(at)), pytest.raises(InputError, match='cannot listen there'):
        listen(at)
    with pytest.raises(InputError, match='does anybody listen'):
        connect(address('tcp'))


# OpenFresco.

FRESCO = [
    {'name': 'command', 'unit': 'in'},
    {'name': 'measured', 'unit': 'in'},
    {'name': 'force', 'unit': 'kip'},
]


@contextmanager
def site(port, answers):
    """A laboratory's site: answers whatever asks for it, and keeps what it heard."""
    heard = []

    def serve():
        with closing(server), closing(server.accept()[0]) as peer:
            stream = peer.makefile('rb')
            heard.append(stream.read(44))
            trial = 0.0
            while len(message := stream.read(256 * 8)) == 256 * 8:
                heard.append(message)
                values = struct.unpack('256d', message)
                if values[0] == 3:
                    trial = values[1]
                elif values[0] in answers:
                    peer.sendall(struct.pack('256d', 0.9 * trial, 7.0 * trial, *[0.0] * 254))

    server = socket.create_server(('127.0.0.1', port))
    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    yield heard
    thread.join(60.0)


def test_the_shadow_of_openfresco_hears_everything_and_changes_nothing():
    here, there = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_STREAM)
    its = terms(layout(FRESCO, forward=f'127.0.0.1:{there}', rate=1000), rate=1000.0)
    reception = Reception(its.layout, 1000.0, in_order=True)
    said, back = [], []
    with (
        closing(listen(f'openfresco://127.0.0.1:{here}', its)) as shadow,
        site(there, (6, 10)) as heard,
    ):
        with closing(socket.create_connection(('127.0.0.1', here))) as client:
            said.append(struct.pack('11i', 1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 256))
            client.sendall(said[-1])
            stream = client.makefile('rb')
            for step in range(50):
                for action, value in ((3, 0.01 * step), (6, 0.0), (10, 0.0)):
                    said.append(struct.pack('256d', action, value, *[0.0] * 254))
                    client.sendall(said[-1])
                    if action != 3:
                        back.append(struct.unpack('256d', stream.read(2048)))
            said.append(struct.pack('256d', 99, *[0.0] * 255))
            client.sendall(said[-1])
            found = received(shadow, 50, reception)
            stream.close()
        assert shadow.counts['messages'] == 50 and not shadow.counts['malformed']
    assert heard == said
    assert np.allclose([b[0] for b in back[::2]], 0.009 * np.arange(50))
    index, command, measured, force = joined(found)
    assert index.tolist() == list(range(50))
    assert np.allclose(command, 0.0254 * 0.01 * np.arange(50))
    assert np.allclose(measured, 0.9 * command)
    assert np.allclose(force, 4448.2216152605 * 7.0 * 0.01 * np.arange(50))


def test_a_shadow_relays_what_it_does_not_understand():
    here, there = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_STREAM)
    its = terms(layout(FRESCO, forward=f'127.0.0.1:{there}', rate=1000))
    with (
        closing(socket.create_server(('127.0.0.1', there))) as server,
        closing(listen(f'openfresco://127.0.0.1:{here}', its)) as listener,
    ):
        with closing(socket.create_connection(('127.0.0.1', here))) as client:
            peer = server.accept()[0]
            client.sendall(b'\xff' * 5000)
            with closing(peer):
                assert peer.makefile('rb').read(5000) == b'\xff' * 5000
                peer.sendall(b'answer')
                assert client.makefile('rb').read(6) == b'answer'
            assert listener.receive(0.1) == []
        assert listener.counts['malformed'] == 1


def test_lines_with_another_number_of_entries_are_counted_and_give_no_sample():
    """A controller of decimal commas: five entries where the layout has three."""
    its = layout([{'name': 'counter', 'type': 'uint32'}, *PLAIN_PAIR], rate=500)
    at = address('tcp')
    with closing(listen(at, terms(its, 500.0))) as listener:
        port = int(at.rpartition(':')[2])
        with closing(socket.create_connection(('127.0.0.1', port))) as peer:
            lines = [b'%d,1,2340,1,2290\n' % n for n in range(20)]
            lines += [b'%d,1.5,1.25,7.0\n' % n for n in range(20, 40)]
            lines += [b'%d,1.5,1.25\n' % n for n in range(40, 60)]
            peer.sendall(b''.join(lines))
            found = received(listener, 20, Reception(its, 500.0, in_order=True))
    index, command, measured, _ = joined(found)
    assert index.tolist() == list(range(20))
    assert np.allclose(command, 1.5e-3) and np.allclose(measured, 1.25e-3)
    assert listener.counts['malformed'] == 40
    assert "b'" not in listener.hint and '4 entries in place of 3' in listener.hint


@pytest.mark.parametrize('end', [b'\n', b'\r\n', b'\r', b'\n\n'])
@pytest.mark.parametrize('size', [1, 7, 10_000])
def test_lines_may_end_as_their_sender_ends_them(end, size):
    """Cut anywhere on the way; with carriage returns alone nothing seemed to arrive."""
    its = layout([{'name': 'counter', 'type': 'uint32'}, *PLAIN_PAIR], rate=500)
    at = address('tcp')
    with closing(listen(at, terms(its, 500.0))) as listener:
        port = int(at.rpartition(':')[2])
        with closing(socket.create_connection(('127.0.0.1', port))) as peer:
            sent_whole = end.join(b'%d,1.5,1.25' % n for n in range(21)) + end
            for start in range(0, len(sent_whole), size):
                peer.sendall(sent_whole[start : start + size])
            found = received(listener, 21, Reception(its, 500.0, in_order=True))
    assert joined(found)[0].tolist() == list(range(21))
    assert listener.counts['malformed'] == 0


@pytest.mark.parametrize('channels', [1, 3])
def test_a_stream_of_lsl_with_another_number_of_channels_is_not_heard(channels):
    """Channels known by their place alone are as many as the layout has."""
    its = layout(PLAIN_PAIR)
    at = address('lsl')
    pylsl = pytest.importorskip('pylsl', reason='no pylsl: pip install "actuator_glue[lab]"')
    with closing(listen(at, terms(its))) as listener:
        name = at.removeprefix('lsl:')
        info = pylsl.StreamInfo(name, 'servo', channels, 1000.0, 'double64', f'{name}-sender')
        outlet = pylsl.StreamOutlet(info)
        end = time.monotonic() + 60.0
        while not listener.counts['malformed'] and time.monotonic() < end:
            outlet.push_sample([1.0] * channels)
            assert not listener.receive(0.2)
    assert listener.counts['malformed']
