"""use_sim_time: a /clock that runs, stands still and jumps; the streams keep to it."""

import time

import numpy as np
import pytest
from actuator_glue_msgs.msg import SampleBlock
from rclpy.qos import QoSProfile
from ros_nodes import RATE, Timekeeper

from actuator_glue.nodes.pacer import Pacer, Step


@pytest.fixture
def clock(probe):
    keeper = Timekeeper(probe)
    yield keeper
    keeper.end()


def stamps(blocks):
    return np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in blocks])


@pytest.mark.parametrize('node', ['actuator_sim', 'lab_bridge'])
def test_a_stream_runs_pauses_and_jumps_with_the_clock(node, start, probe, clock, tmp_path):
    blocks = []
    probe.create_subscription(SampleBlock, 'samples', blocks.append, QoSProfile(depth=1000))
    given = {'rate': RATE, 'duration': 600.0}
    if node == 'lab_bridge':
        seconds = np.arange(round(600 * RATE)) / RATE
        file = tmp_path / 'test.csv'
        table = np.column_stack([seconds, np.sin(seconds), np.sin(seconds - 0.02)])
        np.savetxt(file, table, delimiter=',', header='time_s,command_mm,measured_mm', comments='')
        given = {'file': str(file), 'specimen_stiffness': 1e5}
    process = start(node, use_sim_time=True, wait_for=1, **given)
    # It runs: stamps are the clock's, a second of it is a second of samples.
    probe.until(lambda: len(blocks) > 40, 60, 'samples')
    first, then = len(blocks), clock.now
    probe.for_a_while(1.5)
    assert abs(stamps(blocks[-1:])[0] - clock.now) < 0.3
    assert abs((len(blocks) - first) * 10 / RATE - (clock.now - then)) < 0.3
    # Twice as fast.
    clock.speed, first, then = 2.0, len(blocks), clock.now
    probe.for_a_while(1.5)
    assert abs((len(blocks) - first) * 10 / RATE - (clock.now - then)) < 0.4
    # It stands still: so does the stream, once what was due has left.
    clock.speed = 0.0
    probe.for_a_while(0.5)
    first = len(blocks)
    probe.for_a_while(1.0)
    assert len(blocks) == first
    clock.speed = 1.0
    probe.until(lambda: len(blocks) > first + 20, 10, 'it goes on')
    # It jumps, ahead and back: no sample is left out, none is made in a hurry.
    for jump in (500.0, -700.0):
        clock.now += jump
        first, then = len(blocks), clock.now
        probe.for_a_while(1.5)
        assert abs(stamps(blocks[-1:])[0] - clock.now) < 0.3
        assert abs((len(blocks) - first) * 10 / RATE - (clock.now - then)) < 0.4
    index = np.concatenate([np.arange(m.index, m.index + len(m.command)) for m in blocks])
    assert np.array_equal(index, np.arange(index[0], index[0] + len(index)))
    steps = np.diff(stamps(blocks))
    assert (np.abs(steps - 10 / RATE) > 0.2).sum() == 2
    assert process.alive and process.end() == 0, process.text


def test_a_pacer_keeps_to_the_clock_it_is_given():
    """By hand: standing still holds it up, a jump is gone on from."""
    now, done, jumps = [0.0], [], []
    steps = (Step(0.1 * (i + 1), lambda i=i: done.append(i)) for i in range(1000))
    pacer = Pacer(
        steps, lambda: True, 1.0, lambda _: None, lambda: now[0], lambda: jumps.append(now[0])
    )

    def at(value, count):
        now[0] = value
        time.sleep(0.1)
        assert len(done) == count

    pacer.start()
    at(0.0, 0)
    at(0.55, 5)
    at(0.55, 5)
    at(100.0, 5)
    at(100.22, 7)
    at(50.0, 7)
    at(50.25, 10)
    pacer.stop()
    assert jumps == [100.0, 50.0]
