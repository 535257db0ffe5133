"""Run a node until a signal or its own end."""

from __future__ import annotations

import gc
import sys
import time
import traceback
from collections.abc import Callable, Sequence

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.signals import SignalHandlerOptions

from actuator_glue.errors import InputError
from actuator_glue.nodes import logs, transport
from actuator_glue.nodes.base import ERROR, SUCCESS, SuiteNode
from actuator_glue.nodes.executor import Executor
from actuator_glue.nodes.misspelt import misspelt
from actuator_glue.nodes.signals import Stop

# How long other nodes of a process go on after its stream has ended, for the last windows [s].
LINGER = 5.0


def main(make: Callable[[], SuiteNode], args: Sequence[str] | None = None) -> int:
    """Run a node until SIGINT, SIGTERM or its own end; return the exit code."""
    given = list(sys.argv[1:] if args is None else args)
    beside = given[: given.index('--ros-args')] if '--ros-args' in given else given
    if beside:
        text = 'a node takes parameters only, as --ros-args -p NAME:=VALUE, or --params-file FILE'
        print(f'error: {" ".join(beside)}: {text}', file=sys.stderr)
        return 2
    return together([make], args)


def together(makes: Sequence[Callable[[], SuiteNode]], args: Sequence[str] | None = None) -> int:
    """Run nodes in one process until a signal or the end of a test; return the exit code.

    A test ends with the node that carries its samples or its records; any other may go.

    Args:
        makes: make the nodes, started in this order and ended in the opposite one.
        args: the command line; None for the process's own.
    """
    stop = Stop()
    transport.choose()
    try:
        rclpy.init(args=logs.arranged(args), signal_handler_options=SignalHandlerOptions.NO)
    except (rcl.RCLError, rcl.RCLInvalidROSArgsError, rcl.UnknownROSArgsError) as error:
        # A file of parameters that is not there or is none, an option of ROS that is misspelt.
        print(f'error: {error}', file=sys.stderr)
        return 2
    nodes: list[SuiteNode] = []
    try:
        for make in makes:
            nodes.append(make())
    except InputError as error:
        print(f'error: {error}', file=sys.stderr)
        rclpy.try_shutdown()
        return 2
    for text in misspelt(nodes):
        nodes[0].get_logger().warning(text)
    executor = Executor()
    for node in nodes:
        executor.add_node(node)
    stop.wake = lambda: nodes[0].wake()
    code = 0 if all(_begin(node, stop) for node in nodes) else 2
    if code:
        stop.set()
    # The objects that exist now stay: the garbage collector need not scan them while samples wait.
    gc.collect()
    gc.freeze()
    _spin(executor, nodes, stop)
    if stop.reason:
        nodes[0].get_logger().info(f'{stop.reason}: ending')
    for node in reversed(nodes):
        code = max(code, _leave(executor, node))
    rclpy.try_shutdown()
    stop.done()
    return code


def _begin(node: SuiteNode, stop: Stop) -> bool:
    """Start a node that is to start by itself; return whether the others may go on.

    A node's refusal ends all before a test begins. An exception that nobody foresaw is logged,
    and ends the others only where they need the node.
    """
    if stop.is_set() or not node.parameters['autostart']:
        return True
    for step in node.trigger_configure, node.trigger_activate:
        found = step()
        if found != SUCCESS:
            return found == ERROR and not node.carries
    return True


def _spin(executor: Executor, nodes: list[SuiteNode], stop: Stop) -> None:
    end = float('inf')
    while not stop.is_set() and rclpy.ok():
        for node in [n for n in nodes if n.finished]:
            if node.carries or len(nodes) == 1:
                linger = LINGER if len(nodes) > 1 else 0.0
                end = min(end, time.monotonic() + linger)
            else:
                nodes.remove(node)
                _leave(executor, node)
        if time.monotonic() >= end:
            return
        try:
            executor.spin_once(None if end == float('inf') else 0.1)
        except ExternalShutdownException:
            return
        except Exception as error:
            # E.g. a packet that cannot be decoded, or a transition asked for in a wrong state.
            nodes[0].complain_of_bug(error)


def _leave(executor: Executor, node: SuiteNode) -> int:
    """End a node and return its exit code; whatever it raises, the others come to their end."""
    try:
        _end(node)
        executor.remove_node(node)
        node.destroy_node()
    except Exception as error:
        node.get_logger().error('cannot end: ' + ''.join(traceback.format_exception(error)))
        return 1
    return node.exit_code


def _end(node: SuiteNode) -> None:
    if node.state in ('unconfigured', 'inactive', 'active'):
        node.trigger_shutdown()
        node.until_heard()
    else:
        # Shut down by a service: the answer must leave before the node that gives it is gone.
        time.sleep(0.3)
