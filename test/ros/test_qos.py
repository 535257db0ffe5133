"""Quality of service: overridden by parameters, adapted to by the recorder, told of."""

import signal
import time

import numpy as np
import pytest
from actuator_glue_msgs.msg import SampleBlock
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from ros_nodes import QUICK, RATE, recorded
from std_msgs.msg import String

from actuator_glue.io.bag_reader import decoded
from actuator_glue.nodes import transport

BEST_EFFORT = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=5, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_durability_is_overridden_by_a_parameter(start, probe):
    name = 'qos_overrides./samples.publisher.durability'
    simulator = start('actuator_sim', wait_for=99, **{name: 'transient_local'})
    probe.until(lambda: probe.value('actuator_sim', 'state') == 'active')
    probe.until(lambda: probe.get_publishers_info_by_topic('/samples'))
    (found,) = probe.get_publishers_info_by_topic('/samples')
    assert found.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert simulator.end() == 0


def test_the_recorder_adapts_to_what_is_offered(start, probe, tmp_path):
    """Best effort where the suite is reliable; latched messages from before it began."""
    bag = tmp_path / 'bag'
    note = probe.create_publisher(String, 'note', LATCHED)
    note.publish(String(data='written before'))
    # Named twice, and one of the suite's: each is recorded once all the same.
    recorder = start('recorder', bag=str(bag), topics=['note', '/note', 'samples'])
    samples = probe.create_publisher(SampleBlock, 'samples', BEST_EFFORT)
    probe.until(lambda: samples.get_subscription_count(), what='adapted')
    for index in range(0, 100, 10):
        samples.publish(SampleBlock(index=index, command=np.zeros(10), measured=np.zeros(10)))
        probe.for_a_while(0.02)
    probe.until_recorded(bag, 50)

    def noted():
        found = decoded(bag, ('std_msgs/msg/String',), note=lambda _: None)
        return [m.data for _, m in found]

    probe.until(lambda: probe.for_a_while(0.1) or noted(), what='what was written before')
    assert recorder.end() == 0, recorder.text
    assert noted() == ['written before']
    assert recorded(bag).tolist() == list(range(100))


@pytest.mark.slow
def test_a_partner_that_will_never_be_heard_is_a_warning(start, probe):
    estimator = start('estimator', **QUICK)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'estimator compiled')
    probe.create_publisher(SampleBlock, 'samples', BEST_EFFORT)
    told = 'nothing is heard of /probe on /samples: reliable is asked for, best effort offered'
    probe.until(lambda: told in probe.faults['estimator'], what='warning')
    probe.for_a_while(2.5)
    # It stays, and is logged once.
    assert int(probe.value('estimator', 'incompatible QoS (count)')) >= 3
    assert estimator.text.count(told) == 1
    assert estimator.end() == 0


def test_a_node_in_place_of_a_killed_one_hears_at_once(start, probe, tmp_path):
    """Over shared memory none did for 3 s. A busy computer may hold one up, never each of them."""
    simulator = start('actuator_sim', rate=RATE, duration=600.0)
    waits = []
    # What the first one waits for is discovery alone.
    for attempt in range(10):
        name = f'recorder_{attempt}'
        recorder = start('recorder', name=name, bag=str(tmp_path / name), diagnostics_period=0.1)
        probe.until(lambda p=recorder: 'recording to' in p.text, what='recorder')
        begun = time.monotonic()
        probe.until(lambda p=recorder: count(tmp_path / p.name), what='samples')
        waits.append(time.monotonic() - begun)
        recorder.process.send_signal(signal.SIGKILL)
        recorder.process.wait()
        if sum(wait < 2.0 for wait in waits[1:]) == 2:
            break
    else:
        raise AssertionError(waits)
    assert simulator.end() == 0


def count(bag):
    """Samples that are in the file of a bag being written."""
    return len(list(decoded(bag, ('SampleBlock',), note=lambda _: None)))


def test_transport_is_chosen_only_for_those_who_have_not():
    chosen = {'FASTDDS_BUILTIN_TRANSPORTS': 'SHM', transport.RANGE: 'LOCALHOST'}
    before = dict(chosen)
    transport.choose(chosen)
    assert chosen == before
    other = {'RMW_IMPLEMENTATION': 'rmw_cyclonedds_cpp'}
    transport.choose(other)
    assert len(other) == 1
    network, local = {}, {transport.RANGE: 'LOCALHOST'}
    transport.choose(network)
    transport.choose(local)
    assert network['FASTDDS_BUILTIN_TRANSPORTS'] == 'UDPv4'
    assert 'dds_network' in network['FASTRTPS_DEFAULT_PROFILES_FILE']
    assert 'dds_local' in local['FASTRTPS_DEFAULT_PROFILES_FILE']
