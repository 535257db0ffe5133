"""Run a node until a signal or its own end."""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable, Sequence

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.signals import SignalHandlerOptions

from actuator_glue.errors import InputError
from actuator_glue.nodes import transport
from actuator_glue.nodes.base import SUCCESS, SuiteNode
from actuator_glue.nodes.executor import Executor
from actuator_glue.nodes.signals import Stop


def main(make: Callable[[], SuiteNode], args: Sequence[str] | None = None) -> int:
    """Run a node until SIGINT, SIGTERM or its own end; return the exit code."""
    stop = Stop()
    transport.choose()
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = make()
    except InputError as error:
        print(f'error: {error}', file=sys.stderr)
        rclpy.try_shutdown()
        return 2
    executor = Executor()
    executor.add_node(node)
    stop.wake = node.wake
    code = 0
    if node.parameters['autostart'] and not stop.is_set():
        started = node.trigger_configure() == SUCCESS and node.trigger_activate() == SUCCESS
        if not started:
            code = 2
            stop.set()
    # What is there now stays: the garbage collector need not go through it while samples wait.
    gc.collect()
    gc.freeze()
    while not stop.is_set() and not node.finished and rclpy.ok():
        try:
            executor.spin_once()
        except ExternalShutdownException:
            break
        except Exception as error:
            # E.g. a packet that cannot be decoded, or a transition asked for in a wrong state.
            node.complain_of_bug(error)
    if node.state in ('unconfigured', 'inactive', 'active'):
        node.trigger_shutdown()
    else:
        # Shut down by a service: the answer must leave before the node that gives it is gone.
        time.sleep(0.3)
    executor.remove_node(node)
    node.destroy_node()
    rclpy.try_shutdown()
    stop.done()
    return code
