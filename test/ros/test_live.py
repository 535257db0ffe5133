"""Live streams through lab_bridge: samples to the bit, faults told, results back."""

import socket
import struct
import subprocess
import sys
import time
from collections import defaultdict
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from actuator_glue_msgs.msg import PredictionBand
from ros_nodes import QUICK, RATE, recorded

from actuator_glue.io.bag_reader import decoded
from actuator_glue.io.bag_records import write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.model import linear
from actuator_glue.model.commands import noise
from actuator_glue.nodes import lab_live, topics
from actuator_glue.nodes.blocks import BlockPublisher
from actuator_glue.nodes.health import Rate
from actuator_glue.nodes.lab_live import LiveSource
from actuator_glue.records import Record
from actuator_glue.streams.results import FIELDS

LAYOUTS = Path(__file__).resolve().parents[2] / 'config' / 'layouts'


def free_port(kind=socket.SOCK_DGRAM):
    with closing(socket.socket(socket.AF_INET, kind)) as found:
        found.bind(('127.0.0.1', 0))
        return found.getsockname()[1]


def write(path, samples, rate, seed=0):
    """A bag of one record of a linear actuator."""
    command = noise(rate, samples / rate, 0.2, 8.0, seed=seed)[:samples]
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    clean = linear.simulate(theta, command, stiffness=250e3, period=1 / rate)
    measured = clean + 1e-5 * np.random.default_rng(seed).standard_normal(len(clean))
    record = Record(command, measured, 1 / rate, 250e3, force=250e3 * clean, start_ns=10**18)
    with BagWriter(path) as writer:
        write_record(writer, record)
    return record


def send(bag, to, *options):
    """The command, in a process of its own, as on another computer."""
    command = [sys.executable, '-m', 'actuator_glue.cli.main', 'send', str(bag), '--to', to]
    return subprocess.Popen([*command, *options], stderr=subprocess.PIPE, text=True)


def channels(bag):
    """Command, measured and force of every sample in a bag."""
    blocks = [m for _, m in decoded(bag, ('SampleBlock',))]
    parts = ('command', 'measured', 'force')
    return [np.concatenate([getattr(m, name) for m in blocks]) for name in parts]


def carried(start, probe, tmp_path, scheme, rate, seconds, layout=None):
    """Stream a record through bridge and recorder; return it and what was recorded."""
    kind = socket.SOCK_DGRAM if scheme == 'udp' else socket.SOCK_STREAM
    at = (
        f'lsl:servo-{free_port()}'
        if scheme == 'lsl'
        else f'{scheme}://127.0.0.1:{free_port(kind)}'
    )
    samples = round(rate * seconds)
    given, bag = tmp_path / 'given', tmp_path / 'bag'
    record = write(given, samples, rate)
    recorder = start('recorder', bag=str(bag))
    bridge = start(
        'lab_bridge',
        source=at,
        layout=layout or '',
        rate=rate,
        wait_for=1,
        block=round(rate / 100),
    )
    probe.until(lambda: 'the stream begins' in bridge.text, what='bridge')
    sender = send(given, at, *(['--layout', layout] if layout else []))
    probe.until(
        lambda: probe.number('lab_bridge', 'samples') == samples, seconds + 60, 'all samples'
    )
    assert sender.wait(60) in (0, 1), sender.stderr.read()
    probe.until_recorded(bag, samples)
    assert bridge.end() == 0, bridge.text
    assert recorder.end() == 0, recorder.text
    return record, bag


def whole(probe, record, bag):
    """Nothing was lost, and every sample is what was sent."""
    assert np.array_equal(recorded(bag), np.arange(len(record)))
    for name in ('lost', 'duplicates', 'malformed', 'implausible', 'overruns'):
        assert probe.number('lab_bridge', name) == 0, name


@pytest.mark.parametrize(
    'scheme',
    [
        'udp',
        pytest.param('tcp', marks=pytest.mark.slow),
        pytest.param('lsl', marks=pytest.mark.slow),
    ],
)
def test_a_record_that_is_sent_is_recorded_to_the_bit(scheme, start, probe, tmp_path):
    if scheme == 'lsl':
        pytest.importorskip('pylsl', reason='no pylsl: pip install "actuator_glue[lab]"')
    record, bag = carried(start, probe, tmp_path, scheme, 1000.0, 3.0)
    whole(probe, record, bag)
    for found, sent in zip(
        channels(bag), (record.command, record.measured, record.force), strict=True
    ):
        assert np.array_equal(found, sent)
    stamps = [
        m.header.stamp.sec * 10**9 + m.header.stamp.nanosec
        for _, m in decoded(bag, ('SampleBlock',))
    ]
    assert (np.diff(stamps) > 0).all() and abs(stamps[0] * 1e-9 - time.time()) < 60


def test_a_layout_carries_ten_samples_per_datagram(start, probe, tmp_path):
    layout = str(LAYOUTS / 'dspace.yaml')
    record, bag = carried(start, probe, tmp_path, 'udp', 10_000.0, 1.0, layout)
    whole(probe, record, bag)
    command, measured, force = channels(bag)
    # 32-bit values, in mm and kN.
    assert np.allclose(command, record.command, atol=1e-9)
    assert np.allclose(measured, record.measured, atol=1e-9)
    assert np.allclose(force, record.force, rtol=1e-6, atol=1e-3)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(('rate', 'seconds'), [(2000.0, 600.0), (10_000.0, 60.0)])
def test_no_sample_is_lost_at_the_rates_of_laboratories(rate, seconds, start, probe, tmp_path):
    record, bag = carried(start, probe, tmp_path, 'udp', rate, seconds)
    whole(probe, record, bag)
    assert np.array_equal(channels(bag)[1], record.measured)


def datagram(number, command=0.0, measured=None):
    measured = float(number) if measured is None else measured
    return struct.pack('<Idddd', number % 2**32, number * 1e-3, command, measured, 0.0)


def test_what_is_sent_as_soon_as_the_stream_begins_is_in_it():
    """A program that waits for that line sends at once; what came before is no part of it."""
    port, found = free_port(), []
    clock = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=time.time_ns()))
    values = dict.fromkeys(('file', 'layout', 'key_file', 'actuator'), '')
    values |= {'source': f'udp://127.0.0.1:{port}', 'rate': 1000.0, 'specimen_stiffness': 0.0}
    values |= {'hold': 'file', 'block': 10, 'allow': []}
    with closing(socket.socket(type=socket.SOCK_DGRAM)) as out:
        out.connect(('127.0.0.1', port))

        def begin(prepare):
            out.send(datagram(6))
            prepare()
            for number in range(7, 10):
                out.send(datagram(number))

        node = SimpleNamespace(
            get_clock=lambda: clock, introduce=begin, samples=Rate(), complain=lambda *_: None
        )
        source = LiveSource(node, values, BlockPublisher(lambda topic: Sink(topic, found)))
        try:
            for step in source.steps():
                step.act()
                if node.samples.count >= 3:
                    break
        finally:
            source.close()
    assert [i for m in found for i in range(m.index, m.index + len(m.command))] == [0, 1, 2]
    assert np.concatenate([m.measured for m in found]).tolist() == [7.0, 8.0, 9.0]


def listening(tmp_path, layout, scheme='udp'):
    """A LiveSource, what it complains of by kind, and the port that it listens to."""
    kind = socket.SOCK_DGRAM if scheme == 'udp' else socket.SOCK_STREAM
    port, said = free_port(kind), defaultdict(str)
    path = tmp_path / 'layout.yaml'
    path.write_text(yaml.safe_dump(layout))
    clock = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=time.time_ns()))
    values = dict.fromkeys(('file', 'key_file', 'actuator'), '')
    values |= {'source': f'{scheme}://127.0.0.1:{port}', 'rate': 0.0, 'specimen_stiffness': 0.0}
    values |= {'hold': 'file', 'block': 10, 'allow': [], 'layout': str(path)}

    def complain(kind, message, *_):
        said[kind] += f'{message}\n'

    node = SimpleNamespace(
        get_clock=lambda: clock, introduce=lambda _: None, samples=Rate(), complain=complain
    )
    return LiveSource(node, values, BlockPublisher(lambda topic: Sink(topic, []))), said, port


def told(tmp_path, layout, messages, scheme='udp'):
    """What LiveSource complains of, by kind, while it hears these messages of a layout."""
    source, said, port = listening(tmp_path, layout, scheme)
    kind = socket.SOCK_DGRAM if scheme == 'udp' else socket.SOCK_STREAM
    waiting, end = list(messages), time.monotonic() + 60.0
    with closing(source), closing(socket.socket(type=kind)) as out:
        out.connect(('127.0.0.1', port))
        for step in source.steps():
            step.act()
            for message in waiting[:5]:
                out.send(message)
            del waiting[:5]
            # Silence is told once a second: all has been heard by then.
            if {'silence', 'no sample'} & said.keys() or time.monotonic() > end:
                break
        source.report()
    return said


PAIR = [{'name': 'command', 'unit': 'mm'}, {'name': 'measured', 'unit': 'mm'}]
COUNTED = [{'name': 'counter', 'type': 'uint32'}, *PAIR]
MOTION = 5.0 * np.sin(0.1 * np.arange(1, 801))


@pytest.mark.parametrize('value', [float, np.float32])
def test_bytes_in_another_order_are_told_where_neither_counter_nor_time_shows_them(
    value, tmp_path
):
    """Swapped doubles are of any size; those that were float32 once, of none at all."""
    swapped = [struct.pack('>dd', value(x), value(0.9 * x)) for x in MOTION]
    said = told(tmp_path, {'rate': 200, 'sample': PAIR}, swapped)
    assert 'check byte_order' in said['out of range']


@pytest.mark.parametrize(
    ('live', 'given', 'idle'),
    [
        (False, {'rate': 500.0}, ['rate = 500.0']),
        (False, {'channels': '', 'speed': 50.0, 'preview': 1.0}, []),
        (True, {'speed': 2.0, 'channels': 'map.yaml'}, ["channels = 'map.yaml'", 'speed = 2.0']),
        (True, {'block': 20, 'hold': 'zoh', 'actuator': 'east'}, []),
    ],
)
def test_what_says_nothing_of_a_source_or_file_is_told(live, given, idle, start, probe, tmp_path):
    file = tmp_path / 'x.csv'
    rows = [f'{i / 100},{i % 7 * 1e-4},{(i - 2) % 7 * 1e-4}\n' for i in range(200)]
    file.write_text('time_s,command_m,measured_m\n' + ''.join(rows))
    its = {'file': str(file)}
    if live:
        its = {'source': f'udp://127.0.0.1:{free_port()}', 'rate': 500.0}
    bridge = start('lab_bridge', specimen_stiffness=0.0, **its, **given)
    probe.until(lambda: 'the stream begins' in bridge.text or not bridge.alive)
    told = [line for line in bridge.text.splitlines() if 'does nothing' in line]
    assert len(told) == len(idle), bridge.text
    assert all(name in line for name, line in zip(idle, told, strict=True))


@pytest.mark.parametrize('quiet', [0.0, 1e-40])
def test_what_rests_is_not_taken_for_bytes_in_another_order(quiet, tmp_path):
    """A simulated actuator that has come to rest is at numbers near zero."""
    motion = np.concatenate([MOTION[:20], np.full(800, quiet)])
    good = [struct.pack('<Idd', i, 0.0, x) for i, x in enumerate(motion)]
    said = told(tmp_path, {'rate': 200, 'sample': COUNTED}, good)
    assert not said['out of range'] and not said['no sample'] and not said['malformed']


def test_messages_of_which_none_can_be_used_are_no_silence(tmp_path):
    swapped = [struct.pack('>Idd', i, x, x) for i, x in enumerate(MOTION, 1)]
    said = told(tmp_path, {'rate': 200, 'sample': COUNTED}, swapped)
    assert 'check the layout' in said['no sample'] and 'far off' in said['implausible']


def test_the_first_samples_after_a_silence_are_no_fault(tmp_path, monkeypatch):
    """They wait for those that may come before them, and a second may end meanwhile."""
    now = [0.0]
    clock = SimpleNamespace(monotonic=lambda: now[0], sleep=lambda _: None)
    monkeypatch.setattr(lab_live, 'time', clock)
    source, said, port = listening(tmp_path, {'rate': 200, 'sample': COUNTED})
    with closing(source), closing(socket.socket(type=socket.SOCK_DGRAM)) as out:
        out.connect(('127.0.0.1', port))
        steps = source.steps()
        next(steps).act()
        for i, at in enumerate((1.01, 1.02, 1.2)):
            now[0] = at
            out.send(struct.pack('<Idd', i, 1.0, 1.0))
            next(steps).act()
        assert source._node.samples.count and not said


def test_a_connection_that_says_nothing_is_silent(tmp_path):
    said = told(tmp_path, {'rate': 200, 'sample': COUNTED, 'header': True}, [], 'tcp')
    assert said['silence'] and not said['no sample']


def test_a_wrong_rate_is_told_in_the_same_words_each_time(tmp_path):
    """What lasts is logged once only where its words stay."""
    timed = [COUNTED[0], {'name': 'time', 'unit': 's'}, *PAIR]
    slow = [struct.pack('<Iddd', i, i / 100, x, x) for i, x in enumerate(MOTION)]
    said = told(tmp_path, {'rate': 200, 'sample': timed}, slow)['sample rate'].splitlines()
    assert said and all('give the true one' in line for line in said)


@pytest.mark.parametrize(
    ('step', 'lost', 'wrong'),
    [
        (1, (), False),
        (10, (), True),
        (10, (100, 300), True),
        # Half of them are lost, on a bad line.
        (1, np.flatnonzero(np.random.default_rng(3).random(600) < 0.6), False),
    ],
)
def test_a_counter_of_another_loop_is_told_as_that(step, lost, wrong, tmp_path):
    """Each sample came with a gap, and a rate that had it so was asked for."""
    sent = [struct.pack('<Idd', step * i, x, x) for i, x in enumerate(MOTION[:600])]
    sent = [message for i, message in enumerate(sent) if i not in lost]
    said = told(tmp_path, {'rate': 1000, 'sample': COUNTED}, sent)
    assert ('the counter counts something else' in said['counter']) is wrong


def test_times_of_another_rate_are_no_counter(tmp_path):
    timed = [{'name': 'time', 'unit': 's'}, *PAIR]
    slow = [struct.pack('<ddd', i / 100, x, x) for i, x in enumerate(MOTION)]
    said = told(tmp_path, {'rate': 1000, 'sample': timed}, slow)
    assert said['sample rate'] and not said['counter']


def test_a_counter_of_samples_is_no_counter_of_packets(tmp_path):
    packets = [struct.pack('<I8d', 4 * i, *range(8)) for i in range(200)]
    its = {'rate': 1000, 'packet': COUNTED[:1], 'sample': PAIR, 'samples': 4}
    assert 'counts: packets or samples' in told(tmp_path, its, packets)['counter']
    assert not told(tmp_path, {**its, 'counts': 'samples'}, packets)['counter']


def test_a_message_of_another_size_is_told_with_both_sizes(tmp_path):
    twice = [2 * struct.pack('<Idd', i, x, x) for i, x in enumerate(MOTION[:20])]
    said = told(tmp_path, {'rate': 200, 'sample': COUNTED}, twice)
    assert 'has 40 bytes, the layout has 20' in said['malformed']


class Sink:
    """A publisher whose blocks of samples are kept."""

    def __init__(self, topic, found):
        self.topic, self.msg_type, self._found = topic, topic.type, found

    def publish(self, message):
        if self.topic is topics.SAMPLES:
            self._found.append(message)


def test_every_fault_of_a_wire_is_told_and_no_sample_is_made_up(start, probe, tmp_path):
    port, bag = free_port(), tmp_path / 'bag'
    recorder = start('recorder', bag=str(bag))
    bridge = start('lab_bridge', source=f'udp://127.0.0.1:{port}', rate=1000.0, wait_for=1)
    probe.until(lambda: 'the stream begins' in bridge.text)
    probe.until(lambda: 'nothing arrives' in probe.faults['lab_bridge'])
    out = socket.socket(type=socket.SOCK_DGRAM)

    def put(*numbers, value=None):
        for number in numbers:
            out.sendto(
                datagram(number, value or 1e-6 * number, 2e-6 * number), ('127.0.0.1', port)
            )
            time.sleep(1e-3)

    def told(name):
        probe.until(lambda: probe.number('lab_bridge', name) >= 1, what=name)
        assert bridge.alive

    with closing(out):
        put(*range(100))
        put(103, 104)
        told('lost')
        put(104)
        told('duplicates')
        # Those that come more than 50 ms after their place are late, not out of order: here no
        # time passes between the two.
        with bridge.held():
            put(106, 105)
        put(*range(107, 120))
        told('reordered')
        put(102)
        told('late')
        put(2**31)
        put(*range(120, 130))
        told('implausible')
        out.sendto(b'not a packet', ('127.0.0.1', port))
        told('malformed')
        put(130, value=float('nan'))
        told('not finite')
        put(*range(131, 140))
        put(*range(50))
        told('restarts')
        probe.until(lambda: probe.number('lab_bridge', 'samples') == 187, what='samples')
    probe.until_recorded(bag, 187)
    assert bridge.end() == 0 and recorder.end() == 0
    assert 'Traceback' not in bridge.text
    sent = [*range(100), *range(103, 140), *range(50)]
    assert recorded(bag).tolist() == sent
    command, measured, _ = channels(bag)
    assert np.isnan(command[sent.index(130)]) and np.allclose(measured, 2e-6 * np.array(sent))
    assert len([1 for _, m in decoded(bag, ('TestSetup',))]) == 2


def unpacked(data):
    """Results by name."""
    return dict(zip(FIELDS, struct.unpack(f'<{len(FIELDS)}d', data), strict=True))


@pytest.mark.slow
def test_results_go_back_to_the_controller(start, probe, tmp_path):
    """A datagram of doubles per window, and how long the band takes from its last sample."""
    port, given = free_port(), tmp_path / 'given'
    at = f'udp://127.0.0.1:{free_port()}'
    record = write(given, round(8 * RATE), RATE)
    late = []

    def band(message):
        if message.scored and message.kind == 'total':
            last = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            last += (len(message.median) - 1) * message.period
            late.append(time.time() - last)

    probe.create_subscription(PredictionBand, 'prediction_band', band, 50)
    estimator = start('estimator', **QUICK)
    margin = start('margin', partition='sdof')
    bridge = start(
        'lab_bridge',
        source=at,
        rate=RATE,
        specimen_stiffness=250e3,
        wait_for=1,
        block=2,
        results=f'udp://127.0.0.1:{port}',
    )
    controller = socket.socket(type=socket.SOCK_DGRAM)
    with closing(controller):
        controller.bind(('127.0.0.1', port))
        probe.until(lambda: 'the stream begins' in bridge.text, 250, 'estimator compiled')
        sender = send(given, at)
        probe.until(lambda: probe.number('lab_bridge', 'results sent') >= 4, what='results')
        controller.settimeout(20.0)
        values = unpacked(controller.recv(1000))
        # The same window once more, as soon as P(unstable) is known.
        risk = values
        while np.isnan(risk['p_unstable']):
            before, risk = risk, unpacked(controller.recv(1000))
    assert all(before[name] == risk[name] for name in ('window', 'time', 'delay', 'beta_1_mean'))
    assert 0.0 <= risk['p_unstable'] <= risk['p_unstable_upper'] <= 1.0
    probe.until(lambda: probe.number('lab_bridge', 'samples') == len(record), what='all samples')
    assert sender.wait(60) in (0, 1)
    # At 5 Hz this actuator goes 0.5002 of the way.
    assert 0.0 < values['delay'] < 0.1 and 0.4 < values['amplitude'] < 0.6
    assert abs(values['time'] - time.time()) < 60
    assert 20.0 < values['beta_1_mean'] < 400.0 and values['beta_1_stddev'] > 0.0
    print(f'last sample to band: median {np.median(late):.3f} s, worst {max(late):.3f} s')
    # A window may be computed for half a second.
    assert np.median(late) < QUICK['time_budget'] + 0.5
    assert estimator.end() == 0 and bridge.end() == 0 and margin.end() == 0


@pytest.mark.parametrize(
    ('parameters', 'told'),
    [
        ({'source': 'udp://0.0.0.0:5005', 'rate': 1000.0}, 'say which may send'),
        ({'source': 'http://127.0.0.1:80'}, 'no address of a stream'),
        ({'source': 'udp://127.0.0.1:5005'}, 'the sample rate is not known'),
        ({'source': 'udp://127.0.0.1:5005', 'file': 'x.csv'}, 'keep one'),
        ({'source': 'openfresco://127.0.0.1:5005', 'rate': 100.0}, 'forward'),
        ({'source': 'udp://127.0.0.1:5005', 'layout': 'no.yaml'}, 'layout cannot be read'),
        ({'file': 'x.csv', 'results': 'udp://192.0.2.1:5005'}, 'name it in allow'),
        ({}, 'give a laboratory file or a bag'),
    ],
)
def test_what_cannot_be_listened_to_is_said(parameters, told, start):
    bridge = start('lab_bridge', **parameters)
    assert bridge.wait(60) == 2
    assert told in bridge.text and 'Traceback' not in bridge.text
