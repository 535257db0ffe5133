"""Nodes listen when their workers can compute, and say what they wait for."""

import pytest
from ros_nodes import QUICK, NotReady

from actuator_glue.nodes import diagnoser, estimator, topics
from actuator_glue.nodes.executor import Executor
from actuator_glue.online.stream import Dropped


@pytest.mark.parametrize('make', [estimator.EstimatorNode, diagnoser.DiagnoserNode])
def test_samples_are_listened_to_once_the_worker_is_ready(make, probe):
    node = make()
    executor = Executor()
    executor.add_node(node)
    node.trigger_configure()
    begun, node.worker.ready = node.worker.ready, NotReady()
    node.trigger_activate()
    topic = node.resolve_topic_name(topics.SAMPLES.name)
    for _ in range(30):
        executor.spin_once(0.02)
    assert node.count_subscribers(topic) == 0 and node.compiling
    node.worker.ready.come_true()
    probe.until(lambda: executor.spin_once(0.02) or node.count_subscribers(topic))
    if make is estimator.EstimatorNode:
        for ready, why in ((False, 'the worker is still compiling'), (True, 'took longer')):
            node.worker.ready = NotReady()
            if ready:
                node.worker.ready.come_true()
            node._tell([Dropped(3, 0)])
            assert why in node.health._faults['deadline'][1]
    node.worker.ready = begun
    node.trigger_shutdown()
    executor.remove_node(node)
    node.destroy_node()


@pytest.mark.slow
def test_a_stream_says_for_whom_it_waits(start, probe):
    simulator = start('actuator_sim', wait_for=2)
    waits = 'waiting for 2 subscribers of samples, 0 are there'
    probe.until(lambda: simulator.text.count(waits) >= 2, what='said, and said again')
    start('estimator', **QUICK)
    probe.until(lambda: '2 subscribers of samples, 1 is there' in simulator.text, 250)
    assert 'the stream begins' not in simulator.text
    assert simulator.end() == 0
