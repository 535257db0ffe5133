"""What breaks other nodes: each is logged, shown on /diagnostics, and survived."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from actuator_glue_msgs.action import Diagnose
from actuator_glue_msgs.msg import SampleBlock
from rclpy.action import ActionClient
from rclpy.duration import Duration
from ros_nodes import QUICK, RATE, Timekeeper, stranger
from std_msgs.msg import String

from actuator_glue.io.bag_reader import decoded, messages
from actuator_glue.model import linear
from actuator_glue.model.commands import noise
from actuator_glue.nodes.topics import SAMPLES
from actuator_glue.records import Record

BAG = Path(__file__).resolve().parents[2] / 'bags' / 'undeclared_clamped'


def good(seconds, seed=0):
    """A record of the linear plant."""
    command = noise(RATE, seconds, 0.2, 8.0, seed=seed)
    theta = np.array([134.0, 1.1e9, 2.5e5, 0.5])
    clean = linear.simulate(theta, command, stiffness=250e3, period=1 / RATE)
    measured = clean + 1e-5 * np.random.default_rng(seed).standard_normal(len(clean))
    return Record(command, measured, 1 / RATE, 250e3)


def children_of(pid):
    """Process ids of a process's children."""
    tasks = Path(f'/proc/{pid}/task').iterdir()
    return [child for task in tasks for child in (task / 'children').read_text().split()]


def test_estimator_and_recorder_outlive_every_bad_input(start, probe, tmp_path):
    bag = tmp_path / 'bag'
    recorder = start('recorder', bag=str(bag))
    estimator = start('estimator', diagnostics_period=0.2, **QUICK)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'estimator compiled')
    probe.open_stream(listeners=2)

    def tried(told, act):
        """Do something bad; what is told of it appears on /diagnostics."""
        act()
        probe.until(lambda: told in probe.faults['estimator'], what=told)
        assert estimator.alive and recorder.alive

    tried('nothing on test_setup yet', lambda: probe.block(np.zeros(3), np.zeros(3)))
    tried('specimen stiffness -5 N/m', lambda: probe.setup(stiffness=-5.0))
    tried('rate -1 Hz is not positive', lambda: probe.setup(rate=-1.0))
    tried("hold 'cubic'", lambda: probe.setup(hold='cubic'))
    with stranger(String, 'samples') as wrong:
        tried('std_msgs/msg/String', lambda: wrong.publish(String(data='hello')))
    probe.setup(index=probe.index)
    probe.stream(good(1.0))
    bad = np.full(5, np.nan)
    tried('measured is NaN or infinite', lambda: probe.block(np.zeros(5), bad))
    tried('it is empty', lambda: probe.block([], []))
    tried('measured is 1e+06 m', lambda: probe.block(np.zeros(3), [0.0, 1e6, 0.0]))
    tried('channels have different lengths', lambda: probe.block(np.zeros(4), np.zeros(3)))
    tried('period nan s', lambda: probe.block(np.zeros(3), np.zeros(3), period=np.nan))
    tried('says 200 Hz', lambda: probe.block(np.zeros(3), np.zeros(3), period=0.5))
    probe.stream(good(0.5))
    tried(
        'samples are missing before', lambda: probe.block([0.0], [0.0], index=probe.index + 1000)
    )
    probe.stream(good(0.5))
    tried(
        'the clock jumped by -',
        lambda: probe.block(np.zeros(3), np.zeros(3), stamp_ns=probe.start_ns - 10**9),
    )
    probe.stream(good(0.5))
    tried('sample index went back', lambda: probe.block([0.0], [0.0], index=3))
    # One sample at a time is not bad; and after all that the estimator estimates.
    probe.index = 10_000
    record = good(5.0, seed=3)
    probe.stream(record.slice(0, 30), size=1, pause=0.0)
    before = probe.number('estimator', 'windows')
    probe.stream(record.slice(30, len(record)), pause=0.02)
    probe.until(lambda: probe.number('estimator', 'windows') >= before + 2, what='windows')
    # What has not reached a recorder when it ends is lost, and it may be further behind.
    assert probe.samples_out.wait_for_all_acked(Duration(seconds=60.0))
    assert estimator.end() == 0 and recorder.end(signal.SIGTERM) == 0
    assert 'Traceback' not in estimator.text + recorder.text

    # Nothing recorded is lost: what was sent is in the bag, good or bad.
    blocks = [m for _, m in decoded(bag, ('SampleBlock',))]
    assert sum(np.isnan(m.measured).any() for m in blocks) == 1
    assert sum(len(m.command) == 0 for m in blocks) == 1
    assert any(np.abs(m.measured).max(initial=0.0) == 1e6 for m in blocks)
    assert blocks[-1].index + len(blocks[-1].command) == 10_000 + len(record)
    setups = [m.specimen_stiffness for _, m in decoded(bag, ('TestSetup',))]
    assert -5.0 in setups


@pytest.mark.parametrize('how', [signal.SIGKILL, signal.SIGTERM])
def test_a_recorder_that_is_ended_keeps_what_it_recorded(how, start, probe, tmp_path):
    """SIGKILL what the file has, which waits for no further message; SIGTERM all it has taken."""
    bag = tmp_path / 'bag'
    killed = how == signal.SIGKILL
    # To a recorder that is told to end nothing is written before.
    recorder = start('recorder', bag=str(bag), **({} if killed else {'flush_period': 10.0}))
    simulator = start('actuator_sim', rate=RATE, wait_for=2, block=2)
    heard = []
    probe.create_subscription(SampleBlock, 'samples', heard.append, SAMPLES.qos)
    probe.until(lambda: heard and heard[-1].index >= 600, what='samples')
    probe.until(lambda: probe.number('recorder', 'messages written') >= 300, what='recorded')
    with simulator.held():
        taken = probe.number('recorder', 'messages written')
        if killed:
            probe.until_recorded(bag, heard[-1].index + 2)
        recorder.process.send_signal(how)
        recorder.process.wait(60)
    assert simulator.end() == 0
    lost = []
    blocks = [m for _, m in decoded(bag, ('SampleBlock',), note=lost.append)]
    indices = np.concatenate([np.arange(m.index, m.index + len(m.command)) for m in blocks])
    assert np.array_equal(indices, np.arange(len(indices)))
    assert (bag / 'metadata.yaml').exists() != killed
    if not killed:
        assert recorder.process.returncode == 0 and not lost
        assert len(list(messages(bag))) >= taken


def worker_of(process):
    """Process id of a node's worker."""
    pids = children_of(process.process.pid)
    (worker,) = [p for p in pids if b'workers.worker' in Path(f'/proc/{p}/cmdline').read_bytes()]
    return int(worker)


@pytest.mark.slow
def test_a_worker_that_is_killed_after_a_warning_is_replaced(start, probe):
    """An error after a warning is logged, and what follows it is done."""
    estimator = start('estimator', **QUICK)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'estimator compiled')
    probe.open_stream()
    probe.block(np.zeros(3), np.zeros(3))
    probe.until(lambda: 'nothing on test_setup' in probe.faults['estimator'], what='a warning')
    os.kill(worker_of(estimator), signal.SIGKILL)
    probe.until(lambda: 'the worker process ended' in probe.faults['estimator'])
    probe.until(lambda: 'goes on from its last window' in estimator.text)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'compiled again')
    probe.setup(index=probe.index)
    assert probe.setup_out.wait_for_all_acked(Duration(seconds=60.0))
    probe.stream(good(5.0), pause=0.02)
    probe.until(lambda: probe.number('estimator', 'windows') >= 1, what='windows')
    # So is the worker of a node that is inactive just then.
    assert probe.transition('estimator', 'deactivate')
    os.kill(worker_of(estimator), signal.SIGKILL)
    probe.for_a_while(1.0)
    assert probe.transition('estimator', 'activate')
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'compiled again')
    assert estimator.end() == 0 and 'Traceback' not in estimator.text


@pytest.mark.slow
def test_a_goal_ends_with_the_worker_that_diagnosed(start, probe):
    diagnoser = start('diagnoser')
    probe.until(lambda: probe.value('diagnoser', 'worker') == 'ready', 250, 'diagnoser compiled')
    probe.open_stream()
    probe.setup(hold='cubic')
    probe.until(lambda: 'cubic' in probe.faults['diagnoser'], what='a warning')
    client = ActionClient(probe, Diagnose, 'diagnoser/diagnose')
    probe.until(client.server_is_ready)
    sent = client.send_goal_async(Diagnose.Goal(records=[str(BAG)]))
    probe.until(sent.done)
    os.kill(worker_of(diagnoser), signal.SIGKILL)
    answer = sent.result().get_result_async()
    probe.until(answer.done, what='result')
    assert not answer.result().result.success
    assert 'the worker process ended' in answer.result().result.message
    probe.until(lambda: probe.value('diagnoser', 'worker') == 'ready', what='another worker')
    assert diagnoser.end() == 0


def test_a_stream_that_its_computer_cannot_keep_up_with_says_so(start, probe):
    # A message per sample, several times as many as Python can send.
    simulator = start('actuator_sim', rate=20_000.0, block=1, rest=0.0)
    probe.until(lambda: 'behind (last)' in probe.health.get('actuator_sim', {}), 120, 'behind')
    assert 'larger blocks' in probe.value('actuator_sim', 'behind (last)')
    assert simulator.end() == 0, simulator.text


@pytest.mark.slow
def test_a_simulated_clock_that_jumps_back_is_said_and_survived(start, probe):
    nodes = {
        'estimator': start('estimator', use_sim_time=True, **QUICK),
        'actuator_sim': start('actuator_sim', use_sim_time=True, rate=RATE, wait_for=1),
    }
    clock = Timekeeper(probe, 100.0)
    for node in nodes:
        probe.until(lambda node=node: node in probe.health, what=node)
    probe.until(lambda: probe.number('estimator', 'samples') > 0, what='samples')
    clock.jump(-50.0)
    for node, process in nodes.items():
        probe.until(lambda node=node: 'the clock jumped by -' in probe.faults[node], what=node)
        assert process.alive
    # The simulator's stamps follow, and the estimator restarts its window for that reason.
    probe.until(lambda: 'at sample' in probe.faults['estimator'], what='stamps')
    clock.end()
    assert all(process.end() == 0 for process in nodes.values())


def test_a_killed_estimator_leaves_no_worker_behind(start, probe):
    estimator = start('estimator', **QUICK)
    probe.until(lambda: 'estimator' in probe.health)
    children = children_of(estimator.process.pid)
    assert children
    estimator.process.send_signal(signal.SIGKILL)
    estimator.process.wait()
    probe.until(lambda: not any(Path(f'/proc/{p}').exists() for p in children), what='orphans')
