"""Whether DDS carries messages on this machine: `python -m actuator_glue.nodes.loopback`.

Two participants of one process, in the user's own domain and transport, exchange a hundred blocks
of samples; the result is one line of JSON.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import rclpy
from actuator_glue_msgs.msg import SampleBlock
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from actuator_glue.nodes import logs, transport
from actuator_glue.nodes.topics import SAMPLES

MESSAGES = 100
DISCOVERY_SECONDS = 10.0
ANSWER_SECONDS = 2.0


def measure() -> dict[str, Any]:
    """Return messages sent and received, discovery time and median latency [s]."""
    contexts = [rclpy.context.Context() for _ in range(2)]
    args = logs.arranged(None)
    for context in contexts:
        rclpy.init(args=args, context=context)
    talker, listener = (
        Node(f'doctor_{i}', context=c, start_parameter_services=False)
        for i, c in enumerate(contexts)
    )
    delays: list[float] = []
    out = talker.create_publisher(SampleBlock, '~/loopback', SAMPLES.qos)
    listener.create_subscription(
        SampleBlock,
        out.topic_name,
        lambda message: delays.append(time.monotonic() - message.period),
        SAMPLES.qos,
    )
    executor = SingleThreadedExecutor(context=contexts[1])
    executor.add_node(listener)
    began = time.monotonic()
    while not out.get_subscription_count() and time.monotonic() - began < DISCOVERY_SECONDS:
        executor.spin_once(0.02)
    discovery = time.monotonic() - began
    for sent in range(MESSAGES):
        out.publish(SampleBlock(period=time.monotonic(), command=[0.0] * 10, measured=[0.0] * 10))
        end = time.monotonic() + ANSWER_SECONDS
        while len(delays) <= sent and time.monotonic() < end:
            executor.spin_once(0.02)
        if len(delays) <= sent:
            break
    executor.shutdown()
    for node, context in zip((talker, listener), contexts, strict=True):
        node.destroy_node()
        rclpy.shutdown(context=context)
    delays.sort()
    return {
        'sent': MESSAGES,
        'received': len(delays),
        'discovery': discovery,
        'median': delays[len(delays) // 2] if delays else None,
    }


if __name__ == '__main__':
    transport.choose()
    print(json.dumps(measure()), file=sys.stdout)
