"""What a launch says on /diagnostics of nodes that ended and are started again."""

from __future__ import annotations

import time
from collections import Counter
from typing import Any

from rclpy.parameter import Parameter
from rclpy.time import Time

from actuator_glue.nodes.health import ERROR, Health
from actuator_glue.nodes.now import now_ns
from actuator_glue.nodes.topics import DIAGNOSTICS

REPORT_SECONDS = 1.0


class Restarts:
    """Tells at once, and every second for whoever joins later.

    Args:
        node: of the launch itself, spun by it.
        simulated: whether /clock has the time.
    """

    def __init__(self, node: Any, simulated: bool) -> None:
        self._node = node
        self._health = Health('launch')
        self._ends: Counter[str] = Counter()
        if simulated:
            node.set_parameters([Parameter('use_sim_time', value=True)])
        self._out = node.create_publisher(DIAGNOSTICS.type, DIAGNOSTICS.name, DIAGNOSTICS.qos)
        self._timer = node.create_timer(REPORT_SECONDS, self._report)

    def ended(self, name: str, code: int) -> None:
        """Tell of the end of a node that will be started again.

        Args:
            name: of the node.
            code: exit code; that of a signal is negative.
        """
        self._ends[name] += 1
        text = f'{name} ended with exit code {code} and is started again; the test goes on'
        self._health.fault(name, text, time.monotonic(), ERROR)
        self._health.values[f'{name}: restarts'] = self._ends[name]
        self._node.get_logger().error(text)
        self._report()

    def _report(self) -> None:
        stamp = Time(nanoseconds=now_ns(self._node.get_clock())).to_msg()
        self._out.publish(self._health.message(time.monotonic(), stamp, 'running'))
