"""Two nodes that publish one topic in turn are told of while they do, and nothing else is."""

import signal
from types import SimpleNamespace

import numpy as np
import pytest
from actuator_glue_msgs.msg import SampleBlock
from ros_nodes import RATE

from actuator_glue.nodes.in_turn import InTurn


def told(numbers, publishers=2):
    """What is told of messages with these numbers."""
    found, node = InTurn(), SimpleNamespace()
    info = SimpleNamespace(node_namespace='/rig', node_name='sim')
    node.get_publishers_info_by_topic = lambda _: [info] * publishers
    for number in numbers:
        found.take({'publication_sequence_number': number})
    return found.told(node, '/samples')


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


def test_who_is_alone_has_nothing_to_end():
    assert told([1, 1, 2, 2, 3, 3, 4, 4], publishers=1) == ''


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
