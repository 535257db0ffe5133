"""The nodes' executor: events of the middleware are heard, and do not cost every block."""

import time

import rclpy
from rclpy.event_handler import EventHandler, SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from actuator_glue.nodes.executor import Executor


def test_a_partner_of_other_quality_is_noticed_while_blocks_arrive(probe, monkeypatch):
    noticed, ticks, waits = [], [], []
    add = EventHandler.add_to_wait_set
    monkeypatch.setattr(
        EventHandler, 'add_to_wait_set', lambda self, to: (waits.append(self), add(self, to))
    )
    node = rclpy.create_node('listener')
    executor = Executor()
    executor.add_node(node)
    try:
        node.create_subscription(
            String,
            'words',
            lambda _: None,
            QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE),
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=noticed.append),
        )
        node.create_timer(0.01, lambda: ticks.append(time.monotonic()))
        probe.create_publisher(
            String, 'words', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        )
        end = time.monotonic() + 20.0
        while not noticed and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.1)
        assert noticed[0].total_count == 1
        # How often do all handlers enter what is waited for? Once a second, not once a tick.
        ticks.clear()
        waits.clear()
        begun = time.monotonic()
        while len(ticks) < 100 or not waits:
            executor.spin_once(timeout_sec=0.1)
        seconds = time.monotonic() - begun
        assert len(waits) <= (2.0 + seconds) * len(set(waits))
        assert len(waits) < 0.2 * len(ticks) * len(set(waits))
    finally:
        executor.remove_node(node)
        node.destroy_node()
