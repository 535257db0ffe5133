"""The node `replay`: whose samples it publishes, and which of the recorded results."""

from collections import defaultdict

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from ros_nodes import RATE, Process

from actuator_glue.inference.choice import choose_model
from actuator_glue.io import messages
from actuator_glue.io.bag_records import write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.nodes import topics
from actuator_glue.nodes.messages import fill
from actuator_glue.nodes.replay import RESULTS
from actuator_glue.online import conversion
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Record


def motion(amplitude, seconds=2.0):
    time = np.arange(round(seconds * RATE)) / RATE
    command = amplitude * np.sin(2 * np.pi * 1.5 * time)
    return Record(command, 0.9 * command, 1 / RATE, 250e3, start_ns=10**18)


@pytest.fixture
def two(tmp_path):
    """A bag with the samples of two actuators."""
    bag = tmp_path / 'two'
    with BagWriter(bag) as writer:
        for space, amplitude in (('/x1', 1e-3), ('/x2', 2e-3)):
            write_record(writer, motion(amplitude), namespace=space)
    return bag


@pytest.fixture
def play(two, tmp_path):
    """Start a replay of some namespace; `start` takes that word for the node's own."""
    running = []

    def begin(space, **parameters):
        given = {'bag': str(two), 'namespace': space, **parameters}
        running.append(Process('replay', f'replay_{len(running)}', given, tmp_path))
        return running[-1]

    yield begin
    for process in running:
        process.kill()


def heard(probe, *wanted):
    """Have a probe collect messages by topic."""
    got = defaultdict(list)
    for topic in wanted:
        probe.create_subscription(topic.type, topic.name, got[topic.name].append, topic.qos)
    return got


def test_one_actuator_of_two_is_chosen(play, probe):
    got = heard(probe, topics.SAMPLES, topics.TEST_SETUP)
    player = play('/x2', speed=20.0, wait_for=1)
    probe.until(lambda: sum(len(m.command) for m in got['samples']) >= 400, what='samples')
    assert player.wait(60) == 0, player.text
    command = np.concatenate([m.command for m in got['samples']])
    assert command == pytest.approx(motion(2e-3).command) and len(got['test_setup']) == 1


def test_two_actuators_without_a_choice_are_refused(play, probe):
    player = play('')
    probe.until(lambda: 'choose one with the parameter namespace' in player.text)
    assert 'samples of 2 actuators (/x1/samples, /x2/samples)' in player.text
    other = play('x3')
    probe.until(lambda: "no samples under 'x3'" in other.text)


def test_all_results_are_published_again(start, probe, tmp_path):
    """What the estimator announced comes first, and keeps nobody from the first set-up."""
    bag, record = tmp_path / 'results', motion(1e-3)
    announced = conversion.estimator_setup(EstimatorSettings(), choose_model(), 0, 0)
    with BagWriter(bag) as writer:

        def write(topic, fields):
            name = topic.type.__name__
            head = conversion.Head(record.start_ns, record.actuator)
            message = fill(topic.type(), head, fields)
            data = serialize_message(message)
            writer.add_topic('/' + topic.name, name)
            writer.write('/' + topic.name, messages.deserialize(name, data), record.start_ns)

        write(topics.ESTIMATOR_SETUP, announced)
        write_record(writer, record)
        for topic in RESULTS:
            if topic is not topics.ESTIMATOR_SETUP:
                write(topic, {})
    got = heard(probe, *RESULTS, topics.SAMPLES, topics.TEST_SETUP)
    player = start('replay', bag=str(bag), results=True, speed=20.0, wait_for=1)
    names = [topic.name for topic in (*RESULTS, topics.SAMPLES, topics.TEST_SETUP)]
    assert {'posterior_draws', 'estimator_setup', 'stability_margin'} < set(names)
    probe.until(lambda: all(got[name] for name in names), what='one of each')
    assert player.wait(60) == 0, player.text
    assert got['estimator_setup'][0].seed == EstimatorSettings().seed
