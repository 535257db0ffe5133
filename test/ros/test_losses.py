"""Slow discovery, stalled subscribers, lost answers: no sample is lost, nobody waits forever."""

import signal
import time
from types import SimpleNamespace

import numpy as np
import pytest
import rclpy
from actuator_glue_msgs.msg import SampleBlock
from actuator_glue_msgs.srv import SetModel
from builtin_interfaces.msg import Time
from rclpy.duration import Duration
from ros_nodes import QUICK, RATE, recorded

from actuator_glue.io.bag_reader import TEST_SETUP, as_published, messages
from actuator_glue.io.bag_records import write_record
from actuator_glue.io.bag_writer import BagWriter
from actuator_glue.io.messages import full_name
from actuator_glue.model.commands import noise
from actuator_glue.nodes import diagnoser, diagnoser_worker
from actuator_glue.nodes.executor import Executor
from actuator_glue.nodes.recorder import RecorderNode
from actuator_glue.nodes.topics import SAMPLES
from actuator_glue.records import Record


@pytest.mark.slow
def test_a_stream_does_not_leave_before_it_is_taken(start, probe, tmp_path):
    """A recorder that is held up until after the end of the stream still gets all of it."""
    samples, size = 150_000, 250
    seconds = np.arange(samples) / RATE
    command = np.sin(2 * np.pi * 1.5 * seconds)
    file, bag = tmp_path / 'test.csv', tmp_path / 'bag'
    rows = np.column_stack([seconds, command, 0.9 * command])
    np.savetxt(file, rows, delimiter=',', header='time_s,command_mm,measured_mm', comments='')
    recorder = start('recorder', bag=str(bag))
    bridge = start(
        'lab_bridge', file=str(file), specimen_stiffness=1e5, speed=250.0, wait_for=2, block=size
    )
    heard = []
    probe.create_subscription(SampleBlock, 'samples', heard.append, SAMPLES.qos, raw=True)
    probe.until(lambda: heard, what='both met')
    recorder.process.send_signal(signal.SIGSTOP)
    probe.until(lambda: len(heard) == samples // size, what='stream')
    probe.for_a_while(1.0)
    recorder.process.send_signal(signal.SIGCONT)
    assert bridge.wait(60) == 0, bridge.text
    assert recorder.end() == 0, recorder.text
    assert np.array_equal(recorded(bag), np.arange(samples))


@pytest.mark.parametrize(
    'node',
    [
        'lab_bridge',
        pytest.param('actuator_sim', marks=pytest.mark.slow),
        pytest.param('replay', marks=pytest.mark.slow),
    ],
)
def test_no_sample_is_sent_before_subscribers_have_the_set_up(node, start, probe, tmp_path):
    """Who has not, may not have heard of the publisher, and would miss what it sends."""
    samples, bag = 600, tmp_path / 'bag'
    seconds = np.arange(samples) / RATE
    command = 1e-3 * np.sin(2 * np.pi * 1.5 * seconds)
    given = {
        'actuator_sim': {'rate': RATE, 'duration': samples / RATE, 'command': 'noise'},
        'lab_bridge': {'file': str(tmp_path / 'given')},
        'replay': {'bag': str(tmp_path / 'given')},
    }
    with BagWriter(tmp_path / 'given') as writer:
        write_record(writer, Record(command, 0.9 * command, 1.0 / RATE, 1e5, start_ns=10**18))
    recorder = start('recorder', bag=str(bag))
    probe.until(lambda: 'bag' in probe.health.get('recorder', {}), what='recorder')
    stream = start(node, autostart=False, wait_for=3, exit_at_end=True, **given[node])
    assert probe.state(node) == 'unconfigured'
    heard = []
    probe.create_subscription(SampleBlock, 'samples', heard.append, SAMPLES.qos, raw=True)
    assert probe.transition(node, 'configure') and probe.transition(node, 'activate')
    probe.until(lambda: probe.number(node, 'subscribers') == 2, what='both met')
    # The stream begins with the third, when one of the others cannot take the set-up.
    recorder.process.send_signal(signal.SIGSTOP)
    probe.create_subscription(SampleBlock, 'samples', lambda _: None, SAMPLES.qos, raw=True)
    probe.until(lambda: probe.number(node, 'subscribers') == 3, what='all met')
    probe.for_a_while(1.0)
    assert not heard
    recorder.process.send_signal(signal.SIGCONT)
    probe.until(lambda: len(heard) > 2, what='stream')
    assert stream.wait(60) == 0, stream.text
    assert recorder.end() == 0, recorder.text
    found = recorded(bag)
    assert len(found) >= samples and np.array_equal(found, np.arange(len(found)))


def test_a_recorder_writes_what_has_reached_it_when_it_is_stopped(probe, tmp_path, monkeypatch):
    """Messages that no callback has seen yet are in the bag."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    recorder = RecorderNode()
    recorder.trigger_configure()
    recorder.trigger_activate()
    probe.open_stream()
    probe.setup()
    for _ in range(50):
        probe.block(np.zeros(20), np.zeros(20))
    for out in probe.setup_out, probe.samples_out:
        assert out.wait_for_all_acked(Duration(seconds=60.0))
    # It is in nobody's executor: no callback has run.
    recorder.trigger_deactivate()
    recorder.destroy_node()
    (bag,) = (tmp_path / 'actuator_glue').iterdir()
    assert np.array_equal(recorded(bag), np.arange(1000))
    found = list(messages(bag))
    assert sum(m.type == TEST_SETUP for m in found) == 1
    # When each was sent is kept beside when it was received: their order is known.
    assert all(0 < m.publish_time < m.log_time for m in found)
    kinds = {full_name('TestSetup'), full_name('SampleBlock')}
    published = [m.publish_time for m in as_published(found) if m.type in kinds]
    assert published == sorted(published)


def test_what_waits_is_taken_without_waiting_for_each_message(probe, tmp_path, monkeypatch):
    """Of 2000 messages a second a quarter was lost beside other work: a look at all cost more."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    recorder = RecorderNode()
    recorder.trigger_configure()
    recorder.trigger_activate()
    executor = Executor()
    executor.add_node(recorder)
    probe.open_stream()
    for _ in range(200):
        probe.block(np.zeros(1), np.zeros(1))
    assert probe.samples_out.wait_for_all_acked(Duration(seconds=60.0))
    looks = 0
    while recorder.received.count < 200:
        executor.spin_once(timeout_sec=1.0)
        looks += 1
        assert looks < 60  # timers and /diagnostics are among them
    executor.remove_node(recorder)
    recorder.trigger_deactivate()
    recorder.destroy_node()
    (bag,) = (tmp_path / 'actuator_glue').iterdir()
    assert np.array_equal(recorded(bag), np.arange(200))


@pytest.mark.slow
def test_windows_that_are_complete_at_once_are_all_estimated(start, probe):
    """What held up the samples, or the computer, is no reason to leave windows out."""
    settings = {**QUICK, 'hop': 2.0, 'time_budget': 2.0}
    estimator = start('estimator', **settings)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'estimator compiled')
    probe.open_stream()
    probe.setup()
    assert probe.setup_out.wait_for_all_acked(Duration(seconds=60.0))
    command = noise(RATE, 14.0, 0.2, 8.0, seed=1)
    for block in np.split(command[:400], 20):
        probe.block(block, 0.9 * block)
    probe.until(lambda: probe.number('estimator', 'windows') == 1, what='first window')
    for block in np.split(command[400:2400], 20):
        probe.block(block, 0.9 * block)
    probe.until(lambda: probe.number('estimator', 'windows') == 6, what='the windows')
    assert probe.number('estimator', 'deadlines missed') == 0
    assert estimator.end() == 0, estimator.text


@pytest.fixture
def node(probe, monkeypatch):
    """A diagnoser in this process, active, in nobody's executor."""
    monkeypatch.setattr(diagnoser, 'ANSWER_SECONDS', 0.5)
    made = diagnoser.DiagnoserNode()
    made.trigger_configure()
    made.trigger_activate()
    yield made
    made.trigger_shutdown()
    made.destroy_node()


def test_an_answer_that_is_lost_does_not_hold_up_the_diagnoser(node, probe, monkeypatch):
    monkeypatch.setattr(diagnoser_worker, 'requested', lambda _: SetModel.Request())
    # Nobody spins the probe: the request arrives and is never answered.
    probe.create_service(SetModel, 'estimator/set_model', lambda _, answer: answer)
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    while not node._model_client.service_is_ready():
        executor.spin_once(0.1)
    outcome = diagnoser_worker.Outcome(diagnosis=SimpleNamespace())
    node._ended = outcome, None
    node._carry(SimpleNamespace())
    assert node._swaps
    while node._swaps:
        executor.spin_once(0.1)
    assert not outcome.applied
    (told,) = node.health.message(time.monotonic(), Time(), 'active').status
    assert told.message == 'no answer within 0.5 s'
