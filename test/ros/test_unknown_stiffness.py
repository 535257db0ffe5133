"""A stiffness that nobody knows: what the nodes say, and for how long."""

import numpy as np
import pytest
from actuator_glue_msgs.action import Diagnose
from rclpy.action import ActionClient
from ros_nodes import QUICK, RATE

from actuator_glue.model import linear
from actuator_glue.records import Record

TOLD = "the specimen stiffness of 'rig' is not known"


def motion(seconds):
    time = np.arange(round(seconds * RATE)) / RATE
    command = 1e-3 * np.sin(2 * np.pi * 2 * time) + 5e-4 * np.sin(2 * np.pi * 5.3 * time)
    theta = [134.0, 1.1e9, 2.5e5, 0.5]
    measured = linear.simulate(theta, command, stiffness=250e3, period=1 / RATE)
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(measured))
    return Record(command, measured + noise, 1 / RATE, 250e3)


@pytest.mark.slow
def test_the_estimator_complains_as_long_as_it_holds_and_no_longer(start, probe):
    estimator = start('estimator', diagnostics_period=0.2, **QUICK)
    probe.until(lambda: probe.value('estimator', 'worker') == 'ready', 250, 'estimator compiled')
    probe.open_stream()
    # What a late joiner gets: both have passed, the second one governs. And one for later. They
    # lie there together with the first samples when the node next looks.
    record = motion(4.0)
    probe.for_a_while(0.5)
    with estimator.held():
        probe.setup(stiffness=-1.0, index=0)
        probe.setup(index=1000)
        probe.index = 4000
        probe.setup(stiffness=-1.0, index=9000)
        probe.stream(record.slice(0, 100))
        probe.for_a_while(0.5)
    probe.stream(record.slice(100, len(record)))
    probe.until(lambda: probe.number('estimator', 'windows') >= 1, what='a window')
    assert TOLD not in probe.faults['estimator']

    probe.setup(stiffness=-1.0, index=probe.index)
    probe.stream(motion(0.5))

    def count():
        return int(probe.value('estimator', 'test set-up (count)', 0))

    probe.until(lambda: TOLD in probe.faults['estimator'], what='complaint')
    # Nothing comes any more, and nothing has changed.
    before = count()
    probe.until(lambda: count() >= before + 3, what='complaint goes on')

    taken = probe.number('estimator', 'samples')
    probe.setup(index=probe.index)
    probe.stream(motion(0.5))
    probe.until(lambda: probe.number('estimator', 'samples') >= taken + 100, what='samples')
    before = count()
    probe.for_reports('estimator', 5)
    assert count() == before
    assert estimator.alive


def test_a_goal_is_told_why_there_is_nothing_to_diagnose(start, probe):
    diagnoser = start('diagnoser', diagnostics_period=0.2)
    probe.until(lambda: probe.value('diagnoser', 'worker') == 'ready', 250, 'compiled')
    probe.open_stream()
    client = ActionClient(probe, Diagnose, 'diagnoser/diagnose')
    probe.until(client.server_is_ready, what='action')

    def answer():
        asked = client.send_goal_async(Diagnose.Goal())
        probe.until(asked.done, what='goal')
        result = asked.result().get_result_async()
        probe.until(result.done, what='result')
        assert not result.result().result.success
        return result.result().result.message

    assert 'no stretch of 5 s' in answer()
    probe.stream(motion(1.0))
    probe.until(lambda: 'nothing on test_setup' in probe.faults['diagnoser'], what='no set-up')
    assert 'nothing on test_setup yet' in answer()
    probe.setup(stiffness=-1.0, index=probe.index)
    probe.stream(motion(6.0))
    probe.until(lambda: TOLD in probe.faults['diagnoser'], what='unknown')
    assert TOLD in answer()
    assert diagnoser.alive
    client.destroy()
