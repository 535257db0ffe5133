"""Numbers of messages tell of two publishers in turn and of lost messages, and of nothing else."""

import signal
from types import SimpleNamespace

import numpy as np
import pytest
from actuator_glue_msgs.msg import SampleBlock
from ros_nodes import RATE

from actuator_glue.nodes.numbering import Numbering


def numbered(numbers):
    found = Numbering()
    for number in numbers:
        found.take({'publication_sequence_number': number})
    return found


def told(numbers, publishers=2):
    """What is told of messages with these numbers."""
    found, node = numbered(numbers), SimpleNamespace()
    info = SimpleNamespace(node_namespace='/rig', node_name='sim')
    node.get_publishers_info_by_topic = lambda _: [info] * publishers
    return found.in_turn(node, '/samples')


@pytest.mark.parametrize(
    'numbers',
    [
        [1, 1, 2, 2, 3, 3, 4, 4],
        [1, 900, 2, 901, 3, 902, 4, 903],
        [*range(100), 1, *range(100, 200), 2, *range(200, 300), 3, *range(300, 400)],
    ],
)
def test_numbers_that_go_back_again_and_again_are_told(numbers):
    """Of publishers that began together, one after the other, or send at other rates."""
    assert '2 publishers share /samples: /rig/sim (2 times)' in told(numbers)


@pytest.mark.parametrize(
    'numbers',
    [
        range(1, 500),
        [*range(1, 500), *range(1, 500)],
        [*range(1, 500, 7), *range(1, 20), *range(1, 30)],
        [None] * 50,
    ],
)
def test_a_node_that_is_started_again_is_no_second_one(numbers):
    """One that is killed is known for a while after; lost messages leave the order."""
    assert told(numbers) == ''


@pytest.mark.parametrize(
    ('numbers', 'lost'),
    [
        (range(700, 900), 0),
        ([1, 2, 5, 6, 9, 10], 4),
        ([*range(1, 50), *range(1, 50)], 0),
        ([1, 2, 5, 1, 2], 2),
        ([700, 701, 5, 702, 703, 6, 704, 8, 706, 707], 2),
        ([*range(1, 50), 1, 49 + 1, 2, *range(3, 60)], 0),
        ([1, 900, 2, 901, 3, 902, 4, 903], 0),
        ([None] * 5, 0),
    ],
)
def test_numbers_left_out_are_messages_that_did_not_arrive(numbers, lost):
    """A late subscriber, a node that is started again and a second one leave out none."""
    assert numbered(numbers).lost == lost


def test_who_is_alone_has_nothing_to_end():
    assert told([1, 1, 2, 2, 3, 3, 4, 4], publishers=1) == ''


@pytest.mark.slow
def test_the_recorder_tells_of_two_simulators_and_of_no_restart(start, probe, tmp_path):
    """A node that was killed, one started in its place, one that is inactive: all is well."""
    recorder = start('recorder', bag=str(tmp_path / 'bag'))
    start('lab_bridge', file='nowhere.csv', autostart=False)
    first = start('actuator_sim', rate=RATE, duration=600.0, wait_for=1)
    probe.until(lambda: probe.number('recorder', 'messages written') > 50, what='samples')
    first.process.send_signal(signal.SIGKILL)
    first.wait(20.0)
    start('actuator_sim', rate=RATE, duration=600.0, wait_for=1)
    written = probe.number('recorder', 'messages written')
    probe.until(lambda: probe.number('recorder', 'messages written') > written + 60)
    assert probe.transition('actuator_sim', 'deactivate')
    assert probe.transition('actuator_sim', 'activate')
    probe.for_reports('recorder', 3)
    assert 'publishers (last)' not in probe.faults['recorder']
    other = probe.create_publisher(SampleBlock, 'samples', 10)
    for index in range(30):
        other.publish(SampleBlock(index=index, command=np.zeros(1), measured=np.zeros(1)))
        probe.for_a_while(0.1)
    probe.until(lambda: 'publishers (last)' in probe.faults['recorder'], what='two publishers')
    said = probe.value('recorder', 'publishers (last)')
    assert 'share /samples: ' in said and '/actuator_sim' in said and '/probe' in said
    assert recorder.end() == 0


def test_a_recorder_that_got_too_few_says_so(start, probe, tmp_path):
    """More came than its subscription keeps while it was held up: its bag was said to be whole."""
    depth = {'qos_overrides./samples.subscription.depth': 20}
    recorder = start('recorder', bag=str(tmp_path / 'bag'), **depth)
    samples = probe.create_publisher(SampleBlock, 'samples', 10)
    probe.until(samples.get_subscription_count, what='subscribed')

    def send(first, count):
        for index in range(first, first + count):
            samples.publish(SampleBlock(index=index, command=np.zeros(1), measured=np.zeros(1)))

    send(0, 10)
    probe.until_recorded(tmp_path / 'bag', 10)
    with recorder.held():
        send(10, 100)
        probe.for_a_while(0.5)
    probe.for_a_while(0.5)
    send(110, 10)
    probe.until(lambda: probe.number('recorder', 'messages not received') > 0, what='lost')
    probe.until(lambda: 'did not reach this node' in probe.faults['recorder'], what='told')
    assert recorder.end() == 1
    assert 'more are lost' in recorder.text
